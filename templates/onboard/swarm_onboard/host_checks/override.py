"""What systemd has in force for each unit, where that is not the file of the release (systemd.unit(5))."""

from __future__ import annotations

import os
import re

from swarm_onboard.agent import files, systemd
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.texts import clipped
from swarm_onboard.host_checks import Judged

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Iterator, List, Tuple

    from swarm_onboard.agent.release_store import Home

    _Pairs = List[Tuple[str, str]]

TABLE = (
    (
        "a drop-in changes how a unit starts, ends, is watched or isolated, such as `Restart=` or `User=`",
        "unhealthy, with its file and keys; others, such as `Environment=` or `MemoryMax=`, are free",
    ),
    ("a unit is masked, or systemd has it from another file or text", "unhealthy"),
)
_PROPERTIES = ("Id", "FragmentPath", "DropInPaths", "NeedDaemonReload", "LoadState")
_UNITS = "/etc/systemd/system"
_SAFETY = (
    *("Exec", "Restart", "StartLimit", "WatchdogS", "Type", "NotifyAccess", "Kill", "SendSIG", "FinalKill"),
    *("Timeout", "TriggerLimit", "RuntimeMax", "SuccessExit", "RemainAfterExit", "OOMPolicy"),
    *("Condition", "Assert"),
)
_ISOLATION = (
    *("User", "Group", "DynamicUser", "SupplementaryGroups", "NoNewPrivileges", "Capability", "Ambient"),
    *("Secure", "Protect", "ProcSubset", "Private", "Restrict", "SystemCall", "IPAddress", "Device"),
    *("MemoryDenyWriteExecute", "BindPaths", "ReadWritePaths", "LockPersonality", "UMask", "RemoveIPC"),
    *("RootDirectory", "RootImage", "NetworkNamespace", "JoinsNamespace", "Delegate"),
)
#: Keys of which each assignment adds to those before, until an empty one.
_LISTS = (
    *("Exec", "SupplementaryGroups", "Capability", "Ambient", "RestrictAddress", "SystemCallFilter"),
    *("IPAddress", "DeviceAllow", "BindPaths", "ReadWritePaths", "Condition", "Assert"),
)
_SPAN = re.compile(r"(?:\s*\d+(?:\.\d+)?\s*(?:ms|s|min|h)?)+")  # systemd.time(7), without rarer units
_SECONDS = {"ms": 0.001, "": 1.0, "s": 1.0, "min": 60.0, "h": 3600.0}
_SAME = {"true": "yes", "on": "yes", "1": "yes", "false": "no", "off": "no", "0": "no"}


class Seen(NamedTuple):
    """A unit of the release, and how it differs from its file, in words."""

    unit: str
    differences: list[str]


def observe(home: Home) -> list[Seen]:
    """Returns the units of the release that systemd knows."""
    manifest = home.known_manifest(home.current())
    if manifest is None:
        return []
    sources = {unit: manifest.links.get(f"{_UNITS}/{unit}", "") for unit in manifest.units}
    known = systemd.properties([unit for unit, source in sources.items() if source], _PROPERTIES)
    return [
        Seen(unit, list(_differences(home, sources[unit], manifest.files[sources[unit]].sha256, shown)))
        for unit, shown in known.items()
        if shown.get("LoadState") != "not-found"
    ]


def _differences(home: Home, source: str, sha256: str, shown: dict[str, str]) -> Iterator[str]:
    if shown.get("LoadState") == "masked":
        yield f"it is masked: sudo systemctl unmask {shown['Id']}"
        return
    file, own = shown.get("FragmentPath", ""), f"{home.current_link}/{source}"
    if file and os.path.realpath(home.outside(file)) != os.path.realpath(own):
        yield f"systemd has read {file} instead of its file"
    text = files.read(own) or b""
    # An edit of the release's own file is a finding of its own.
    if shown.get("NeedDaemonReload") == "yes" and files.digest_of(text) == sha256:
        yield "systemd has read another text than its files have now"
    yield from overridden(home, text, shown.get("DropInPaths", "").split())


def overridden(home: Home, text: bytes, drop_ins: list[str]) -> Iterator[str]:
    """Yields what each drop-in changes in how a unit with ``text`` starts, ends, is watched or isolated."""
    texts = {path: files.read(home.outside(path)) for path in drop_ins}
    yield from (f"{path} cannot be read" for path, found in texts.items() if found is None)
    read = {path: _assignments(found) for path, found in texts.items() if found is not None}
    yield from _overridden(_assignments(text), read)


def _overridden(own: _Pairs, drop_ins: dict[str, _Pairs]) -> Iterator[str]:
    """Yields each drop-in with its assignments of keys that have another value in force than ``own``."""
    everything = [*own, *(pair for pairs in drop_ins.values() for pair in pairs)]
    other = {
        key
        for key, _ in everything
        if key.startswith((*_SAFETY, *_ISOLATION)) and _in_force(key, own) != _in_force(key, everything)
    }
    for path, pairs in drop_ins.items():
        keys = {key: value for key, value in pairs if key in other}
        if keys:
            yield f"{path} has " + " ".join(f"{key}={clipped(value, 40)}" for key, value in keys.items())


def _in_force(key: str, assignments: _Pairs) -> list[str]:
    found: list[str] = []
    for name, value in assignments:
        if name == key:
            found = [*(found if key.startswith(_LISTS) else ()), _span(key, value)] if value else []
    # Programs run, and filters of system calls apply, in their order.
    return found if key.startswith(("Exec", "SystemCall")) else sorted(set(found))


def _span(key: str, value: str) -> str:
    """Returns a time in s, however it is written."""
    if not key.endswith("Sec") or not _SPAN.fullmatch(value):
        return value
    parts = re.findall(r"(\d+(?:\.\d+)?)\s*(ms|s|min|h|)", value)
    return f"{sum(float(number) * _SECONDS[unit] for number, unit in parts):g}"


def _assignments(content: bytes) -> _Pairs:
    found = []
    for line in content.decode("utf-8", "replace").replace("\\\n", " ").splitlines():
        key, is_assigned, value = (part.strip() for part in line.partition("="))
        if is_assigned and key[:1] not in ("#", ";"):
            found.append((key, _usual(key, value)))
    return found


def _usual(key: str, value: str) -> str:
    """Returns one word for equal values. Both of ProtectHome hide all homes (systemd.exec(5))."""
    if key == "ProtectHome" and value == "tmpfs":
        return "yes"
    return _SAME.get(value.lower(), value) if key.startswith(_ISOLATION) else value


def judge(seen: Seen, host: str) -> Judged:
    """Names what a unit has from others."""
    if not seen.differences:
        return Judged("ok", "is in force as the release has it", about=seen.unit)
    again = f"sudo systemctl daemon-reload; sudo systemctl restart {seen.unit}"
    hint = f"on {host}, remove what systemctl cat {seen.unit} has from others, then: {again}"
    return Judged("bad", "; ".join(seen.differences), hint, about=seen.unit)
