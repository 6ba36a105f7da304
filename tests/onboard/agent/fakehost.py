"""A host in a folder: /opt, /etc, a systemd of a few lines; the agent runs against it as its own process."""

from __future__ import annotations

import base64
import json
import subprocess
import sys
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

from swarm_onboard.agent.audit import ChangeEntry
from swarm_onboard.agent.systemd import UnitState
from swarm_onboard.agent.verbs import history, observe

from swarmctl.remote import agent_client
from swarmctl.remote.answer_check import checked
from swarmctl.render.bundle import Bundle, File, Unit
from swarmctl.resources import onboard
from tests.timing import PATIENCE

NONCE = "0123456789abcdef"
NO_SECRETS: Mapping[str, str] = MappingProxyType({})
FOLDER = str(onboard().parent)
BOOT = f"import sys; sys.path.insert(0, {FOLDER!r}); "
BOOT += f"from swarm_onboard.agent.main import serve; serve({NONCE!r})"

#: The state of a unit that runs.
RUNS = UnitState("loaded", "active", "running", "success", "", 1, 0)

# Keeps one file per running unit: its process id, and the release and the secrets it was started from.
SYSTEMCTL = r"""#!/bin/sh
S=$SWARM_PREFIX/units; echo "$*" >> $SWARM_PREFIX/calls
verb=$1; while [ $# -gt 0 ] && [ "$1" != -- ]; do shift; done; [ $# -gt 0 ] && shift
case $verb in
show) for u; do
    active=inactive; pid=0; load=loaded
    [ -e $SWARM_PREFIX/failed-$u ] && active=failed
    [ -e $S/$u ] && { active=active; read -r pid _ < $S/$u; }
    [ -e $SWARM_PREFIX/etc/systemd/system/$u ] || [ -h $SWARM_PREFIX/etc/systemd/system/$u ] || load=not-found
    printf 'Id=%s\nLoadState=%s\nActiveState=%s\n' $u $load $active
    printf 'SubState=running\nMainPID=%s\nNRestarts=0\n\n' $pid
  done ;;
stop) [ -e $SWARM_PREFIX/slow ] && sleep 0.5; while [ -e $SWARM_PREFIX/held ]; do sleep 0.01; done; for u; do
    [ -e $SWARM_PREFIX/sticky-$u ] && { echo "Job for $u timed out" >&2; exit 1; }; rm -f $S/$u; done ;;
reset-failed) for u; do rm -f $SWARM_PREFIX/failed-$u; done ;;
restart) [ ! -e $SWARM_PREFIX/no-recovery ] || { echo "Job for $1 failed" >&2; exit 1; } ;;
start) for u; do
    [ -e $S/$u ] && continue
    release=$(readlink $SWARM_PREFIX/opt/swarm/new/current); release=${release##*/}
    [ -e $SWARM_PREFIX/broken-$u-$release ] && { echo "Job for $u failed" >&2; exit 1; }
    read -r last < $SWARM_PREFIX/pid; echo $((last + 1)) > $SWARM_PREFIX/pid
    echo $((last + 1)) $release $(readlink $SWARM_PREFIX/etc/swarm/new/secrets) > $S/$u
  done ;;
esac
"""


@dataclass(frozen=True)
class Reply:
    """The agent's output. ``status`` is that of its process."""

    status: int
    answer: dict[str, Any] = field(default_factory=dict)
    error: dict[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


class FakeHost:
    def __init__(self, prefix: Path) -> None:
        self.prefix = prefix
        for folder in ("opt", "etc/systemd/system", "etc/udev/rules.d", "run/systemd/system", "bin", "units"):
            (prefix / folder).mkdir(parents=True)
        (prefix / "etc/hosts").write_bytes(b"127.0.0.1 localhost")
        (prefix / "pid").write_text("100\n")
        (prefix / "proc/sys/kernel/random").mkdir(parents=True)
        self.boot(0)
        (prefix / "calls").touch()
        systemctl = prefix / "bin/systemctl"
        systemctl.write_text(SYSTEMCTL)
        systemctl.chmod(0o755)

    def boot(self, number: int) -> None:
        """Have the host be in its boot of this number."""
        (self.prefix / "proc/sys/kernel/random/boot_id").write_text(f"boot-{number}\n")

    def recover(self, failpoint: str = "", code: str = FOLDER) -> int:
        """Run the process of the recovery unit, from ``code``; returns its exit status."""
        with self.recovering(failpoint, code) as process:
            return process.wait(PATIENCE)

    def recovering(self, failpoint: str = "", code: str = FOLDER, **more: str) -> subprocess.Popen[bytes]:
        """Start the process of the recovery unit, with ``more`` in its environment."""
        return subprocess.Popen(
            [sys.executable, "-S", "-s", "-m", "swarm_onboard.agent.recovery", "new"],
            env={**self.environment(failpoint), "PYTHONPATH": code, **more},
        )

    def environment(self, failpoint: str = "") -> dict[str, str]:
        return {
            "PATH": f"{self.prefix}/bin:/usr/bin:/bin",
            "SWARM_PREFIX": str(self.prefix),
            "SWARM_FAILPOINT": failpoint,
        }

    def begin(
        self,
        request: Mapping[str, Any],
        payload: bytes = b"",
        failpoint: str = "",
        stdout: int = subprocess.PIPE,
    ) -> subprocess.Popen[bytes]:
        """Start the agent and give it the request."""
        process = subprocess.Popen(
            [sys.executable, "-I", "-S", "-c", BOOT],
            stdin=subprocess.PIPE,
            stdout=stdout,
            stderr=subprocess.DEVNULL,
            env=self.environment(failpoint),
        )
        assert process.stdin is not None
        process.stdin.write(json.dumps({**request, "payload": len(payload)}).encode() + b"\n" + payload)
        process.stdin.close()
        return process

    def ask(self, request: Mapping[str, Any], payload: bytes = b"", failpoint: str = "") -> Reply:
        with self.begin(request, payload, failpoint) as process:
            assert process.stdout is not None
            lines = process.stdout.read().splitlines()
            status = process.wait(PATIENCE)
        lines_read = [decode(line) for line in lines if line]
        final = lines_read[-1] if lines_read and "note" not in lines_read[-1] else {}
        notes = tuple(one["note"] for one in lines_read if "note" in one)
        return Reply(status, final.get("answer", {}), final.get("error", {}), notes)

    def observe(self, **more: Any) -> observe.Answer:
        reply = self.ask({"verb": "observe", "swarm": "new", **more})
        assert not reply.error, reply.error
        return checked(reply.answer, observe.Answer, "the answer")

    def history(self) -> list[ChangeEntry]:
        reply = self.ask({"verb": "history", "swarm": "new"})
        return checked(reply.answer, history.Answer, "the answer").entries

    def apply(
        self, bundle: Bundle, failpoint: str = "", secrets: Mapping[str, str] = NO_SECRETS, **changes: Any
    ) -> Reply:
        return self.ask(*message_for(bundle, secrets, **changes), failpoint)

    def read(self, path: str) -> bytes:
        return (self.prefix / path.lstrip("/")).read_bytes()

    def calls(self) -> list[str]:
        """The systemctl commands so far that change units of the swarm; forgets them."""
        path = self.prefix / "calls"
        lines = [
            line
            for line in path.read_text().splitlines()
            if not line.startswith("show") and "swarm-recovery@" not in line
        ]
        path.write_text("")
        return lines

    def units(self) -> dict[str, str]:
        """The release that each running unit was started from."""
        return {path.name: path.read_text().split()[1] for path in (self.prefix / "units").iterdir()}

    def readers(self) -> dict[str, str]:
        """The set of secrets that each running unit was started with; none for one that had none."""
        found = {path.name: path.read_text().split()[2:] for path in (self.prefix / "units").iterdir()}
        return {unit: words[0].rpartition("/")[2] for unit, words in found.items() if words}

    def outside(self) -> dict[str, str]:
        """Everything below /etc but the recovery unit: the text of files, the target of links."""
        root = self.prefix / "etc"
        found = {}
        for path in sorted(root.rglob("*")):
            if path.name == "swarm-recovery@new.service":
                continue
            if path.is_symlink():
                found[str(path.relative_to(root))] = f"-> {path.readlink()}"
            elif path.is_file():
                found[str(path.relative_to(root))] = path.read_text()
        return found


def decode(line: bytes) -> dict[str, Any]:
    mark = f"@{NONCE} ".encode()
    assert line.startswith(mark), line
    text = line[len(mark) :]
    if text.startswith(b"z:"):
        text = zlib.decompress(base64.b64decode(text[2:]))
    value = json.loads(text)
    assert isinstance(value, dict)
    return value


def bundle(
    version: str,
    units: tuple[str, ...] = ("master", "koala"),
    hosts: str = "10.0.0.1 pi\n",
    *,
    boots: bool = False,
) -> Bundle:
    """A small release: a parameter file per unit, the unit files, a block and a udev rule."""
    files = [File("hosts", hosts.encode()), File("udev/90-swarm.rules", b"# rule\n")]
    links = {"/etc/udev/rules.d/90-swarm-new.rules": "udev/90-swarm.rules"}
    for unit in units:
        files.append(File(f"params/{unit}.yaml", f"version: {version}\n".encode()))
        files.append(File(f"units/{unit}.service", f"# {unit} {version}\n".encode()))
        links[f"/etc/systemd/system/{unit}.service"] = f"units/{unit}.service"
        links[f"/etc/systemd/system/swarm.target.wants/{unit}.service"] = f"units/{unit}.service"
    if boots:
        files.append(File("units/swarm.target", b""))
        links["/etc/systemd/system/multi-user.target.wants/swarm.target"] = "units/swarm.target"
    return Bundle(
        tuple(files),
        tuple(Unit(f"{unit}.service", (f"params/{unit}.yaml",)) for unit in units),
        links,
        {"/etc/hosts": "hosts"},
        swarm="new",
        host="pi",
    )


def payload_of(bundle: Bundle) -> bytes:
    return agent_client.pack(
        bundle.manifest_bytes, {file.path: (file.content, file.mode) for file in bundle.files}
    )


_KINDS = ("stop", "reload", "reload_unit", "restart", "start")  # of steps that the agent takes


def request_for(bundle: Bundle, **changes: Any) -> dict[str, Any]:
    """A request to go from nothing to ``bundle``, with ``changes``; units by the kind of their step."""
    steps = {"start": [unit.name for unit in bundle.units]}
    steps |= {kind: changes.pop(kind) for kind in _KINDS if kind in changes}
    request = {
        "verb": "apply",
        "swarm": "new",
        "txid": agent_client.new_txid(),
        "who": "someone@laptop",
        "previous": None,
        "next": bundle.digest,
        "steps": [
            [kind.replace("_", "-"), unit, "a test"] for kind, units in steps.items() for unit in units
        ],
        "wait": 0.3,
    }
    return {**request, **changes}


def message_for(
    bundle: Bundle, secrets: Mapping[str, str] = NO_SECRETS, **changes: Any
) -> tuple[dict[str, Any], bytes]:
    """As ``request_for``, with values of secrets; and the payload."""
    values = json.dumps(dict(secrets)).encode() if secrets else b""
    return request_for(bundle, secrets=len(values), **changes), values + payload_of(bundle)
