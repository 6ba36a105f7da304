"""Participants in the enclaves of a rendered swarm: each publishes what the spec lets it, and no more."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

from swarmctl.deploy.sros2_keystore import missing
from swarmctl.render.build_bundle import bundles
from tests.loading import load_swarm
from tests.render.dds_security.build import IMPLEMENTATIONS
from tests.render.dds_security.participant import DOMAIN, NEEDED, network, participant

pytestmark = NEEDED
SPEC = f"""
version: 1
name: lab
mode: leader
leader: desk
ros: {{distro: jazzy, sros2: true, domain: {DOMAIN}}}
hosts:
  desk: {{address: 10.0.0.1}}
  k3-pi: {{address: 10.0.0.2}}
  tb3-pi: {{address: 10.0.0.3}}
robots:
  koala: {{type: koala, host: desk}}
  k3: {{type: khepera3, host: k3-pi}}
  tb3: {{type: turtlebot3-burger, host: tb3-pi}}
links:
  - {{kind: wlan, name: lab, hosts: [desk, k3-pi, tb3-pi]}}
  - {{kind: serial, host: desk, robot: koala, usb: {{serial: A}}}}
  - {{kind: serial, host: k3-pi, robot: k3, usb: {{serial: B}}}}
programs:
  joystick: {{host: desk, use: teleop-joy, params: {{device: /dev/input/js0}}}}
  keys: {{host: desk, use: teleop-key}}
  wander: {{robot: k3, package: moves, executable: wander,
           publishes: [{{topic: goal, type: geometry_msgs/PoseStamped}}]}}
  mapper: {{host: tb3-pi, package: slam, executable: map,
           publishes: [{{topic: /map, type: nav_msgs/OccupancyGrid}},
                       {{topic: /k3/pose, type: geometry_msgs/PoseStamped}}]}}
control:
  - {{by: joystick, of: [k3, tb3]}}
  - {{by: keys, of: [tb3], priority: 1}}
"""
ENCLAVES = {
    "hosts/desk", "hosts/k3-pi", "hosts/tb3-pi", "robots/koala", "robots/k3", "robots/tb3", "gates/tb3",
    "programs/joystick", "programs/keys", "programs/wander", "programs/mapper",
}  # fmt: skip
#: `control` names nobody for the Koala: all on its leader's host command it.
LEADER = {"hosts/desk", "robots/koala", "programs/joystick", "programs/keys"}
#: Who may publish each topic, as the names of DDS are.
WRITERS: Mapping[str, set[str]] = {
    "rt/koala/cmd_vel": LEADER,
    "rt/koala/leds": LEADER,
    "rt/koala/odom": {"robots/koala"},
    "rt/koala/proximity/scan": {"robots/koala"},
    "rt/koala/undeclared": {"robots/koala"},
    "rr/koala/driver/get_parametersReply": {"robots/koala"},
    "rt/k3/cmd_vel": {"programs/joystick"},
    "rt/k3/leds": {"programs/joystick"},
    "rt/k3/odom": {"robots/k3"},
    "rt/k3/goal": {"programs/wander"},
    "rt/k3/pose": {"programs/mapper"},
    "rt/k3/undeclared": {"robots/k3", "programs/wander"},
    "rr/k3/driver/get_parametersReply": {"robots/k3", "programs/wander"},
    "rt/tb3/cmd_vel": {"programs/joystick", "programs/keys"},
    "rt/tb3/gate/cmd_vel": {"gates/tb3"},
    "rt/tb3/scan": {"robots/tb3"},
    "rt/tb3/undeclared": {"robots/tb3", "gates/tb3"},
    "rr/tb3/gate/get_parametersReply": {"robots/tb3", "gates/tb3"},
    "rt/map": {"programs/mapper"},
    "rt/map_updates": ENCLAVES,
    "rt/k3": ENCLAVES,
    "rt/k30/odom": ENCLAVES,
    "rt/chat": ENCLAVES,
    "rt/tf": ENCLAVES,
    "rt/rosout": ENCLAVES,
    "rt/diagnostics": ENCLAVES,
    "rq/k3/driver/get_parametersRequest": ENCLAVES,
    "rr/mapper/get_parametersReply": ENCLAVES,
    "ros_discovery_info": ENCLAVES,
}


@pytest.fixture(scope="module")
def namespace() -> Iterator[str]:
    with network() as name:
        yield name


@pytest.fixture(scope="module")
def enclaves(tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, Path]:
    """The folder of each enclave by its name, as its unit makes it on its host."""
    folder, found = tmp_path_factory.mktemp("spec"), dict[str, Path]()
    (folder / "swarm.yaml").write_text(SPEC, "utf-8")
    empty = rendered(folder)
    made = missing([one for bundle in empty.values() for one in bundle.enclaves], {}, {})
    write(folder, made.files)
    for host, bundle in rendered(folder).items():
        assert not bundle.unsigned
        release, runtime, credentials = (folder / host / name for name in ("release", "runtime", "keys"))
        of_enclaves = (one for one in bundle.files if one.path.startswith(("enclaves/", "bin/put-enclave")))
        write(release, {one.path: one.content for one in of_enclaves})
        keys = {one.name.replace("/", "-"): made.secrets[one.key].encode() for one in bundle.enclaves}
        write(credentials, keys)
        names = [one.name for one in bundle.enclaves]
        places = {"RUNTIME_DIRECTORY": str(runtime), "CREDENTIALS_DIRECTORY": str(credentials)}
        script = ["/bin/sh", release / "bin/put-enclave", *names]
        subprocess.run(script, env={**os.environ, **places}, check=True)
        found.update({name: runtime / "enclaves" / name for name in names})
    return found


def rendered(folder: Path) -> Mapping[str, Any]:
    swarm, found = load_swarm(folder / "swarm.yaml")
    assert swarm is not None, found
    return bundles(swarm)


def write(folder: Path, files: Mapping[str, bytes]) -> None:
    for path, content in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_bytes(content)


def test_the_table_has_every_enclave(enclaves: Mapping[str, Path]) -> None:
    assert enclaves.keys() == ENCLAVES


@pytest.fixture(params=IMPLEMENTATIONS)
def start(request: pytest.FixtureRequest, namespace: str, tmp_path: Path) -> Any:
    """Starts a participant of each implementation: the folder of its enclave, and its endpoints."""
    return lambda *words: participant(request.param, namespace, tmp_path, *words)


@pytest.mark.parametrize("name", sorted(ENCLAVES))
def test_an_enclave_publishes_what_the_spec_lets_it_and_reads_all(
    name: str, start: Any, enclaves: Mapping[str, Path]
) -> None:
    endpoints = [f"{kind} {topic}" for kind in ("pub", "sub") for topic in WRITERS]
    with start(enclaves[name], *endpoints) as started:
        created = started.created()
    allowed = {topic for topic, writers in WRITERS.items() if name in writers}
    assert {topic for (kind, topic), made in created.items() if kind == "pub" and made} == allowed
    assert {topic for (kind, topic), made in created.items() if kind == "sub" and made} == {*WRITERS}


def with_files_of_another(folder: Path, enclaves: Mapping[str, Path], names: str) -> Path:
    """The enclave of a driver, with some files of that of its gate."""
    own = {one.name: one.read_bytes() for one in enclaves["robots/tb3"].iterdir()}
    write(folder, {**own, **{name: (enclaves["gates/tb3"] / name).read_bytes() for name in names.split()}})
    return folder


@pytest.mark.parametrize("taken", ["cert.pem", "cert.pem key.pem", "permissions.p7s"])
def test_an_enclave_is_refused_with_files_of_another(
    taken: str, start: Any, enclaves: Mapping[str, Path], tmp_path: Path
) -> None:
    with start(with_files_of_another(tmp_path / "mixed", enclaves, taken)) as started:
        assert not started.accepted()


def test_samples_with_the_key_of_another_enclave_arrive_nowhere(
    start: Any, enclaves: Mapping[str, Path], tmp_path: Path
) -> None:
    mixed = with_files_of_another(tmp_path / "mixed", enclaves, "key.pem")
    with (
        start(mixed, "pub rt/tb3/scan") as impostor,
        start(enclaves["hosts/desk"], "sub rt/tb3/scan", "sub rt/chat") as person,
    ):
        assert not impostor.accepted() or all(impostor.created().values())  # Fast DDS refuses to start it
        assert all(person.created().values())
        with start(enclaves["hosts/k3-pi"], "pub rt/chat"):  # it came later, and is found
            person.receives("rt/chat")
        assert person.received() == {"rt/chat"}


def test_enclaves_exchange_samples(start: Any, enclaves: Mapping[str, Path]) -> None:
    with (
        start(enclaves["robots/k3"], "pub rt/k3/odom", "sub rt/k3/cmd_vel", "sub rt/chat") as driver,
        start(enclaves["programs/joystick"], "pub rt/k3/cmd_vel"),
        start(enclaves["hosts/tb3-pi"], "pub rt/chat", "sub rt/k3/odom", "sub rt/k3/cmd_vel") as person,
    ):
        driver.receives("rt/k3/cmd_vel", "rt/chat")
        person.receives("rt/k3/odom", "rt/k3/cmd_vel")
