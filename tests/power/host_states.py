"""The whole states of a host: of one release, or without the swarm. All between is a mixture."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from swarmctl.render.bundle import Bundle
from tests.packages.agent.fakehost import FakeHost, bundle
from tests.timing import PATIENCE

SECRETS = ("mqtt", "wifi")
OLD = replace(bundle("1", boots=True), secrets=SECRETS)
NEW = replace(bundle("2", units=("master", "khepera"), hosts="10.0.0.2 pi\n", boots=True), secrets=SECRETS)
LAST = replace(bundle("9", units=("koala",), hosts="10.0.0.9 pi\n", boots=True), secrets=SECRETS)
BETWEEN = tuple(replace(bundle(f"1.{number}", boots=True), secrets=SECRETS) for number in range(3))
BUNDLES = {"old": OLD, "new": NEW, "last": LAST} | {f"between {n}": one for n, one in enumerate(BETWEEN)}

_RECOVERY = "systemd/system/swarm-recovery@new.service"
_RECOVERY_LINK = "systemd/system/sysinit.target.wants/swarm-recovery@new.service"
_DRAFT = ".swarm-new"
_SECRETS = "swarm/new/secrets/"


class Finding(NamedTuple):
    """The state of a host: a key of ``BUNDLES``, ``none``, or ``mixed``; what is wrong, and what is left over
    but in nobody's way."""

    state: str
    faults: tuple[str, ...]
    leftovers: tuple[str, ...]


def outside(host: FakeHost) -> dict[str, str]:
    """Everything below /etc but the recovery unit: mode and content of files, targets of links."""
    root = host.prefix / "etc"
    found = {}
    for path in sorted(root.rglob("*")):
        name = str(path.relative_to(root))
        if name in (_RECOVERY, _RECOVERY_LINK):
            continue
        if path.is_symlink():
            found[name] = f"-> {path.readlink()}"
        elif path.is_file():
            found[name] = f"{path.stat().st_mode & 0o7777:o} {path.read_bytes()!r}"
    return found


def expected() -> dict[str, dict[str, str]]:
    """What each state has below /etc, from deploys that nothing disturbs; without secrets."""
    found = {}
    for name, release in {"none": None, **BUNDLES}.items():
        with tempfile.TemporaryDirectory() as folder:
            host = FakeHost(Path(folder))
            if release is not None:
                reply = host.apply(release)
                assert not reply.error, reply.error
            found[name] = outside(host)
    return found


def look(host: FakeHost, known: Mapping[str, dict[str, str]], secrets: Mapping[str, set[str]]) -> Finding:
    """Compares a host after its boot with each whole state; ``secrets``: the values that each may have."""
    seen = outside(host)
    leftovers = [f"/etc/{name}" for name in seen if name.endswith(_DRAFT)]
    kept = {name[len(_SECRETS) :]: text for name, text in seen.items() if name.startswith(_SECRETS)}
    etc = {
        name: text
        for name, text in seen.items()
        if not name.endswith(_DRAFT) and not name.startswith(_SECRETS)
    }
    home = host.prefix / "opt/swarm/new"
    current = home / "current"
    digest = current.readlink().name if current.is_symlink() else None
    state = next((name for name, one in BUNDLES.items() if one.digest == digest), "none")
    faults = [f"current is {state}", *_differences(etc, known[state])] if etc != known[state] else []
    if state != "none":
        faults += _damages(home / "releases" / str(digest), BUNDLES[state])
        if (home / "state/open").exists():
            faults.append("the record is open")
    elif (host.prefix / f"etc/{_RECOVERY}").exists():
        leftovers.append("the recovery unit")
    kept = {name: text for name, text in kept.items() if not name.endswith(_DRAFT)}
    allowed = {name: {f"600 {value.encode()!r}" for value in values} for name, values in secrets.items()}
    faults += [f"secret {name} is {text}" for name, text in kept.items() if text not in allowed.get(name, ())]
    if state == "none":
        leftovers += [f"secret {name}" for name in kept]
    else:
        faults += [f"secret {name} is missing" for name in SECRETS if name not in kept]
    leftovers += _leftovers(host)
    return Finding("mixed" if faults else state, tuple(faults), tuple(leftovers))


def boot(host: FakeHost, number: int) -> str:
    """Boots the host: no unit runs, and systemd runs the recovery unit as its file on the disk says.

    Returns what the unit complained of.
    """
    for unit in (host.prefix / "units").iterdir():
        unit.unlink()
    host.boot(number)
    command = recovery(host)
    if command is None:
        return ""
    done = subprocess.run(
        command[0], env=command[1], capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    return f"recovery ended with {done.returncode}: {done.stderr[-300:]}" if done.returncode else ""


def recovery(host: FakeHost) -> tuple[list[str], dict[str, str]] | None:
    """Returns what systemd runs for the recovery unit at a boot; None if nothing."""
    link, unit = (host.prefix / "etc" / one for one in (_RECOVERY_LINK, _RECOVERY))
    if not link.is_symlink() or link.readlink() != Path("/etc") / _RECOVERY or not unit.is_file():
        return None
    lines = [line.partition("=") for line in unit.read_text().splitlines() if "=" in line]
    values = {key: value for key, _, value in lines}
    if "ExecStart" not in values or not Path(values["ConditionPathExists"]).exists():
        return None
    given = dict(word.split("=", 1) for word in values["Environment"].split())
    command = values["ExecStart"].split()
    return [sys.executable, *command[1:]], {**host.environment(), **given}


def _leftovers(host: FakeHost) -> list[str]:
    """Returns what an interrupted change left in the folder of swarms, and its next change removes."""
    root = host.prefix / "opt/swarm"
    home = root / "new"
    found = [f"/opt/swarm/{path.name}" for path in root.glob(".*")] if root.exists() else []
    found += ["staging" for _ in home.glob("staging/*")][:1]
    found += [f"/opt/swarm/new/{path.relative_to(home)}" for path in home.rglob("*" + _DRAFT)]
    return found


def _differences(seen: Mapping[str, str], wanted: Mapping[str, str]) -> list[str]:
    names = sorted(set(seen) | set(wanted))
    return [
        f"/etc/{name} is {seen.get(name, 'missing')!s:.60}"
        for name in names
        if seen.get(name) != wanted.get(name)
    ]


def _damages(folder: Path, release: Bundle) -> list[str]:
    """Returns the files of a stored release that are not as its bundle has them."""
    found = []
    for file in release.files:
        path = folder / file.path
        if not path.is_file():
            found.append(f"{file.path} is missing")
        elif path.read_bytes() != file.content or path.stat().st_mode & 0o777 != file.mode:
            found.append(f"{file.path} is damaged")
    manifest = folder / "manifest.json"
    if not manifest.is_file() or json.loads(manifest.read_bytes() or b"0") != json.loads(
        release.manifest_bytes
    ):
        found.append("the manifest is damaged")
    return found
