"""The whole states of a host: a release with its secrets, or no swarm. All between is a mixture."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from swarm_onboard.tunnel.keys import line

from swarmctl.render.bundle import Bundle, File
from tests.onboard.agent.fakehost import FakeHost, bundle
from tests.timing import PATIENCE

SECRETS = ("mqtt", "wifi")
OLD = replace(bundle("1", boots=True), secrets=SECRETS)
NEW = replace(bundle("2", units=("master", "khepera"), hosts="10.0.0.2 pi\n", boots=True), secrets=SECRETS)
# A change of one parameter, which the driver takes while it runs.
TUNED = replace(
    OLD,
    files=tuple(
        replace(one, content=b"version: 1.5\n") if one.path == "params/koala.yaml" else one
        for one in OLD.files
    ),
    units=(OLD.units[0], replace(OLD.units[1], robot="koala")),
)
MORE_FILES = replace(OLD, files=(*OLD.files, File("data/map.yaml", b"resolution: 0.05\n")))
LAST = replace(bundle("9", units=("koala",), hosts="10.0.0.9 pi\n", boots=True), secrets=SECRETS)
BETWEEN = tuple(replace(bundle(f"1.{number}", boots=True), secrets=SECRETS) for number in range(3))
FIRST, SECOND = dict.fromkeys(SECRETS, "first"), dict.fromkeys(SECRETS, "second")


PI, OWN, NEXT = (f"{letter}{'A' * 42}=" for letter in "ABC")
KNOWN, RETIRED = line("pi", PI), line("pi", PI, retired=True)
#: The WireGuard keys that a host may have, by what the name of a state has of them.
KEYS = {
    "": {},
    ", key of pi": {"keys": KNOWN},
    ", own key": {"key": OWN},
    ", key": {"key": OWN, "keys": KNOWN},
    ", next key": {"key": OWN, "key.next": NEXT, "keys": KNOWN},
    ", next key, pi expelled": {"key": OWN, "key.next": NEXT, "keys": RETIRED},
    ", new key, pi expelled": {"key": NEXT, "keys": RETIRED},
}


class State(NamedTuple):
    """A release, and the values of its secrets."""

    bundle: Bundle
    secrets: Mapping[str, str]


STATES = {
    "old": State(OLD, FIRST),
    "old, new secrets": State(OLD, SECOND),
    "new": State(NEW, SECOND),
    "old, more files": State(MORE_FILES, FIRST),
    "old, tuned": State(TUNED, FIRST),
    "last": State(LAST, FIRST),
    **{f"between {number}": State(one, FIRST) for number, one in enumerate(BETWEEN)},
}

_RECOVERY = "systemd/system/swarm-recovery@new.service"
_RECOVERY_LINK = "systemd/system/sysinit.target.wants/swarm-recovery@new.service"
_DRAFT = ".swarm-new"
_SECRETS = "swarm/new/secrets"
_SETS = "swarm/new/secret-sets/"
_KEYS = "swarm/new/wireguard."
_LATCH = "swarm/new/stopped/koala"


class Finding(NamedTuple):
    """The state of a host: a key of ``STATES``, ``none``, or ``mixed``, with one of ``KEYS``; what is wrong,
    and what is left over but in nobody's way."""

    release: str
    keys: str
    faults: tuple[str, ...]
    leftovers: tuple[str, ...] = ()
    latched: bool = False

    @property
    def state(self) -> str:
        """What it has, in words."""
        return self.release + self.keys + (", koala stopped" if self.latched else "")


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
    for name, state in {"none": None, **STATES}.items():
        with tempfile.TemporaryDirectory() as folder:
            host = FakeHost(Path(folder))
            if state is not None:
                reply = host.apply(state.bundle)
                assert not reply.error, reply.error
            found[name] = outside(host)
    return found


def look(host: FakeHost, known: Mapping[str, dict[str, str]]) -> Finding:
    """Compares a host after its boot with each whole state."""
    seen = outside(host)
    leftovers = [f"/etc/{name}" for name in seen if name.endswith(_DRAFT)]
    seen = {name: text for name, text in seen.items() if not name.endswith(_DRAFT)}
    etc = {name: text for name, text in seen.items() if not name.startswith((_SECRETS, _SETS))}
    home = host.prefix / "opt/swarm/new"
    current = home / "current"
    digest = current.readlink().name if current.is_symlink() else None
    keys = {name: etc.pop(name) for name in list(etc) if name.startswith(_KEYS)}
    etc = {name: text for name, text in etc.items() if _DRAFT not in name}
    latched = etc.pop(_LATCH, None) is not None
    chosen = seen.get(_SECRETS, "").rpartition("/")[2]
    state = _state(digest, _values(seen, chosen))
    faults = [f"current is {state}", *_differences(etc, known[state])] if etc != known[state] else []
    if state != "none":
        faults += _differences(_values(seen, chosen), _written(STATES[state]), "secret ")
        faults += _damages(home / "releases" / str(digest), STATES[state].bundle)
        if (home / "state/open").exists():
            faults.append("the record is open")
    else:
        faults += ["a link to secrets"] if chosen else []
        leftovers += ["the recovery unit"] if (host.prefix / f"etc/{_RECOVERY}").exists() else []
    kept = _kept(host)
    for release, name in kept:
        values = _values(seen, name)
        if all(one.bundle.digest != release or values != _written(one) for one in STATES.values()):
            faults.append(f"the secrets to go back to {release} are {values}")
    stored = {name[len(_SETS) :].partition("/")[0] for name in seen if name.startswith(_SETS)}
    leftovers += ["a set of secrets" for _ in stored - {name for _, name in kept} - {chosen}]
    leftovers += _leftovers(host)
    whole = next((name for name, one in KEYS.items() if keys == _stored(one)), None)
    faults += [f"the keys of WireGuard are {keys}"] if whole is None else []
    return Finding("mixed" if faults else state, whole or "", tuple(faults), tuple(leftovers), latched)


def _stored(keys: Mapping[str, str]) -> dict[str, str]:
    """Mode and content of the files of keys."""
    contents = {name: f"{text.strip()}\n".encode() for name, text in keys.items()}
    return {f"{_KEYS}{name}": f"{644 if name == 'keys' else 600} {one!r}" for name, one in contents.items()}


def _state(digest: str | None, values: Mapping[str, str]) -> str:
    """Returns the state of this release whose secrets these are; one of its release if there is none."""
    of_release = [name for name, one in STATES.items() if one.bundle.digest == digest]
    return next((name for name in of_release if _written(STATES[name]) == values), [*of_release, "none"][0])


def _written(state: State) -> dict[str, str]:
    """Mode and content of the secrets of a state, by name."""
    return {name: f"600 {value.encode()!r}" for name, value in state.secrets.items()}


def _values(seen: Mapping[str, str], name: str) -> dict[str, str]:
    """Mode and content of the secrets in a set, by name."""
    folder = f"{_SETS}{name}/"
    return {path[len(folder) :]: text for path, text in seen.items() if name and path.startswith(folder)}


def _kept(host: FakeHost) -> list[tuple[str, str]]:
    """The releases to which the host may go back, each with its set of secrets."""
    record = host.prefix / "opt/swarm/new/state/transaction.json"
    return (
        [(one, name) for one, name in json.loads(record.read_bytes())["history"]] if record.exists() else []
    )


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


def _differences(seen: Mapping[str, str], wanted: Mapping[str, str], folder: str = "/etc/") -> list[str]:
    names = sorted(set(seen) | set(wanted))
    return [
        f"{folder}{name} is {seen.get(name, 'missing')!s:.60}"
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
