"""A container of podman on a real host, and secrets of programs: started, pinned, watched, rotated, removed.

The image is made on the host, without a registry; docs/lab.md has what a lab's podman lacks.
"""

from __future__ import annotations

import base64
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.e2e.lab_swarm import HOME, LabSwarm, Note, SshError, lab_of, quoted, until
from tests.timing import Promise

TOKEN, KEY = 'pa$$ "w\\o`rd', "-----BEGIN\nabc\n"
SPEC = """\
version: 1
name: newswarm
mode: central
hub: pi
hosts:
  pi: {address: 192.168.77.11, user: robot}
robots:
  k3: {type: khepera3, host: pi}
links:
  - {kind: wlan, name: lab, hosts: [pi]}
  - {kind: serial, host: pi, robot: k3, usb: {serial: FTDI1234}}
programs:
  seeing:
    robot: k3
    container:
      image: IMAGE
      command:
        - sh
        - -c
        - "env > /out/env; cat {secrets}/key.pem > /out/key; ls /dev > /out/dev; exec sleep 1000"
      volumes: ["/home/robot/out:/out"]
      devices: [/dev/zero]
    environment: {KEY_FILE: "{secrets}/key.pem", PLACE: "{robot} on {host}"}
    memory_mb: 100
    secrets: {env: {TOKEN: {secret: web-token}}, files: {key.pem: {secret: web-key}}}
  web:
    host: pi
    command:
      - sh
      - -c
      - 'cd /home/robot; printf %s "$TOKEN" > token; cat {secrets}/key.pem > key; exec sleep 2000'
    secrets: {env: {TOKEN: {secret: web-token}}, files: {key.pem: {secret: web-key}}}
"""
NOWHERE = "localhost/none@sha256:" + "1" * 64
# A shell, a few programs and their libraries; and an image of another machine, with a shell of none.
MAKE = r"""set -e; mkdir -p out root; cd root
for file in /bin/sh /bin/sleep /bin/cat /bin/ls /usr/bin/env; do
  for one in $file $(ldd $file | grep -o '/[^ ]*'); do mkdir -p .$(dirname $one); cp -L $one .$one; done
done
tar -c . | sudo podman import -q - localhost/seeing:1 >/dev/null
mkdir -p usr/bin; printf '\177ELF\2\1\1nothing' > bin/sh; cp bin/sh usr/bin/sh
tar -c . | sudo podman import -q --arch arm64 - localhost/other:1 >/dev/null
sudo podman image inspect --format '{{.Digest}}' localhost/seeing:1
sudo podman image inspect --format '{{.Id}}' localhost/other:1
"""
UNIT = "swarm-newswarm.seeing"
# A registry for one image, as podman copies it into a folder; one name needs a password.
REGISTRY = r"""
import http.server, json, pathlib, socketserver
manifest = pathlib.Path("manifest.json").read_bytes()
TYPE = json.loads(manifest).get("mediaType", "application/vnd.oci.image.manifest.v1+json")
class Registry(http.server.BaseHTTPRequestHandler):
    def do_GET(self):
        kind, name = self.path.rstrip("/").split("/")[-2:]
        blob = pathlib.Path(name.partition(":")[2] or "none")
        content = manifest if kind == "manifests" else blob.read_bytes() if blob.is_file() else b"{}"
        self.send_response(401 if "/private/" in self.path else 200)
        self.send_header("Content-Length", str(len(content)))
        self.send_header("Content-Type", TYPE if content is manifest else "application/octet-stream")
        self.end_headers()
        if self.command == "GET":
            self.wfile.write(content)
    do_HEAD = do_GET
socketserver.ThreadingTCPServer(("127.0.0.1", 5000), Registry).serve_forever()
"""
INSECURE = '[[registry]]\nlocation = "localhost:5000"\ninsecure = true\n'
SERVE = f"""set -e; echo 1 > root/one
tar -C root -c . | sudo podman import -q - localhost/see:1 >/dev/null
sudo podman push -q localhost/see:1 dir:/home/robot/pushed
sudo podman rmi localhost/see:1 >/dev/null
printf %s {quoted(INSECURE)} | sudo tee /etc/containers/registries.conf.d/lab.conf >/dev/null
printf %s {quoted(REGISTRY)} >registry.py
cd pushed; sudo systemd-run --quiet --same-dir python3 ../registry.py; cd ..
bash -c 'until echo >/dev/tcp/127.0.0.1/5000; do sleep 0.1; done' 2>/dev/null
sha256sum <pushed/manifest.json
"""


@pytest.fixture(scope="module")
def box(workplace: Path) -> Iterator[LabSwarm]:
    """A lab of one host, whose image has podman since the spec has a container."""
    spec = workplace / "box.yaml"
    spec.write_text(SPEC.replace("IMAGE", NOWHERE))
    folder = workplace / "box"
    folder.mkdir()
    with lab_of(f"box-{os.getpid()}", spec, folder) as swarm:
        yield swarm


@pytest.fixture(scope="module")
def images(box: LabSwarm) -> tuple[str, str]:
    """An image that runs, pinned by its digest, and one for another machine, pinned by its ID."""
    digest, other = box.shell("pi", MAKE).split()
    return f"localhost/seeing@{digest}", f"sha256:{other}"


@pytest.fixture(scope="module")
def deployed(box: LabSwarm, images: tuple[str, str]) -> LabSwarm:
    """The swarm with its secrets; without them the deploy has changed nothing."""
    box.spec.write_text(SPEC.replace("IMAGE", images[0]))
    refused = box.deploy()
    assert refused.status != 0
    assert "program seeing needs the secret web-token, which is not on the host" in refused.out
    assert "`swarmctl prepare" not in refused.err
    assert "nothing" in box.shell("pi", f"ls {HOME} 2>/dev/null || echo nothing")
    keep_secrets(box, TOKEN)
    done = box.deploy()
    assert done.status == 0, done.out + done.err
    until(lambda: "dev" in box.shell("pi", "ls out"), "the container does not run")
    return box


def keep_secrets(swarm: LabSwarm, token: str) -> None:
    folder = swarm.spec.parent / "secrets"
    folder.mkdir(exist_ok=True)
    for name, value in (("web-token", token), ("web-key", KEY)):
        (folder / name).write_text(value)
        (folder / name).chmod(0o600)


def test_prepare_pulls_an_image_once(box: LabSwarm, images: tuple[str, str], note: Note) -> None:
    digest = box.shell("pi", SERVE).split()[0]
    image = f"localhost:5000/see@sha256:{digest}"
    box.spec.write_text(SPEC.replace("IMAGE", image.replace("/see@", "/private/see@")))
    refused = box.swarmctl("prepare", "--yes")
    assert refused.status == 3
    assert "`sudo podman login localhost:5000`; swarmctl keeps no credentials" in refused.out, refused.out
    box.spec.write_text(SPEC.replace("IMAGE", image))
    assert f"pull     podman {image}" in box.swarmctl("prepare", "--plan").out
    done = box.swarmctl("prepare", "--yes")
    assert done.status == 0, done.out + done.err
    note("prepare: an image pulled from a registry", f"{done.seconds:.1f} s", "")
    assert box.shell("pi", f"sudo podman image exists {image} && echo there") == "there\n"
    assert "nothing to do" in box.swarmctl("prepare", "--plan").out


def test_a_container_has_its_ros_its_devices_and_its_secrets(deployed: LabSwarm) -> None:
    seen = dict(one.split("=", 1) for one in deployed.shell("pi", "cat out/env").splitlines())
    assert seen["ROS_MASTER_URI"] == "http://192.168.77.11:11311"
    assert (seen["ROS_IP"], seen["ROS_NAMESPACE"]) == ("192.168.77.11", "/k3")
    assert (seen["TOKEN"], seen["PLACE"]) == (TOKEN, "k3 on pi")
    assert deployed.shell("pi", "cat out/key") == KEY
    assert {"zero", "null"} <= set(deployed.shell("pi", "cat out/dev").split())
    group = deployed.shell("pi", f"systemctl show -p ControlGroup --value {UNIT}").strip()
    payload = deployed.shell("pi", "cat /proc/$(pgrep -f '^sleep 1000')/cgroup")
    assert f"{group}/libpod-payload" in payload, "its limits are not those of the unit"
    until(lambda: not deployed.findings(), f"not well: {deployed.findings()}")


def test_a_secret_is_for_its_program_alone(deployed: LabSwarm) -> None:
    assert deployed.shell("pi", "cat token") == TOKEN
    assert deployed.shell("pi", "cat key") == KEY
    plain = deployed.shell("pi", "cat /run/swarm-secrets/*/* /run/swarm-secrets/*/.env* 2>&1 || true")
    assert TOKEN not in plain
    for folder in ("seeing", "web"):
        with pytest.raises(SshError, match="denied"):
            deployed.shell("pi", f"sudo -u nobody cat /run/swarm-secrets/{UNIT[:-6]}{folder}/key.pem")
    everywhere = (
        "sudo cat /proc/[0-9]*/cmdline | tr '\\0' ' '; sudo journalctl --boot --output=export --all;"
        f"sudo grep -r . {HOME} /etc/systemd/system; ls -R {HOME}"
    )
    found = deployed.shell("pi", f"({everywhere}) 2>/dev/null | base64")  # the journal has bytes of any kind
    assert TOKEN[:5].encode() not in base64.b64decode(found)
    shown = deployed.plan()
    assert TOKEN[:5] not in shown.out + shown.err


@pytest.mark.slow
def test_a_rotated_secret_restarts_what_reads_it(deployed: LabSwarm) -> None:
    keep_secrets(deployed, "rotated")
    steps = [(kind, target) for kind, target, _ in deployed.steps()["pi"]]
    units = [f"swarm-newswarm.{one}.service" for one in ("seeing", "web")]
    assert steps == [("secret", "web-token"), *(("restart", unit) for unit in units)]
    assert deployed.deploy().status == 0
    until(lambda: "TOKEN=rotated" in deployed.shell("pi", "cat out/env"), "the container has the old one")
    until(lambda: deployed.shell("pi", "cat token") == "rotated", "the program has the old one")


def test_a_container_that_is_stopped_killed_or_ended(deployed: LabSwarm, promise: Promise) -> None:
    stopped = "a signal has stopped its process"
    deployed.shell("pi", "sudo pkill -STOP -f '^sleep 1000'")
    assert stopped in deployed.findings()["program seeing"]["message"]
    deployed.shell("pi", "sudo pkill -CONT -f '^sleep 1000'")

    before = deployed.units("pi")["seeing"].restarts
    deployed.shell("pi", f"sudo podman kill {UNIT}")
    again = until(
        lambda: deployed.units("pi")["seeing"].restarts > before and UNIT in running(deployed),
        "the container is not started again",
    )
    promise("a container is back after it was killed", again, 20)

    deployed.shell("pi", f"sudo systemctl stop {UNIT}", timeout=40)
    assert running(deployed) == ""
    state = deployed.shell("pi", f"systemctl show -p ActiveState --value {UNIT}").strip()
    assert state == "inactive", "a container that is stopped counts as failed"


def running(swarm: LabSwarm) -> str:
    return swarm.shell("pi", "sudo podman ps --format '{{.Names}}'").strip()


@pytest.mark.slow
def test_status_names_an_image_that_is_missing_or_of_another_machine(
    deployed: LabSwarm, images: tuple[str, str]
) -> None:
    for image, words in (
        (NOWHERE, f"its image is not on host pi: {NOWHERE}"),
        (images[1], "its image is built for arm64, and host pi is x86_64"),
    ):
        deployed.spec.write_text(SPEC.replace("IMAGE", image))
        assert deployed.deploy().status == 0
        until(
            lambda words=words: words in deployed.findings().get("program seeing", {}).get("message", ""),
            f"status does not say that {words}",
        )


@pytest.mark.slow
def test_removed_no_container_and_no_secret_is_left(deployed: LabSwarm, images: tuple[str, str]) -> None:
    deployed.spec.write_text(SPEC.replace("IMAGE", images[0]))
    assert deployed.deploy().status == 0
    until(lambda: UNIT in running(deployed), "the container does not run")
    assert deployed.swarmctl("remove", "--yes").status == 0
    left = "sudo podman ps --all --quiet; sudo find /run/swarm-secrets /etc/swarm -type f 2>/dev/null || true"
    assert deployed.shell("pi", left) == ""
