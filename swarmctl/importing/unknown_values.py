"""Values that a draft leaves open: those that only the host has, and what may be a secret."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace

from swarmctl.importing.draft import Value
from swarmctl.ros_packages.launch_files import Place


class Unknown:
    """The attributes of launch files that depend on a substitution; each is to fill in, or not read."""

    def __init__(self, reasons: Mapping[tuple[Place, str], Mapping[str, str]]) -> None:
        self._reasons = reasons
        self._filled: set[tuple[Place, str]] = set()
        self.path = ""  # of what starts the node in question; empty for any

    def has(self, place: Place, *keys: str) -> bool:
        """Returns True if one of these attributes depends on a substitution."""
        return any(self._why(place, key) for key in keys)

    def _why(self, place: Place, key: str) -> str:
        found = self._reasons.get((place, key), {})
        return found.get(self.path, "") if self.path else next(iter(found.values()), "")

    def filled(self, value: Value, place: Place, *keys: str) -> Value:
        """Returns a value that is to fill in if one of these attributes depends on a substitution."""
        for key in keys:
            if why := self._why(place, key):
                self._filled.add((place, key))
                value = replace(value, fill_in=f"{place}: {_depends(key, why)}")
        return value

    def unread(self) -> Iterator[str]:
        """Yields the places that are not to fill in."""
        for (place, key), whys in self._reasons.items():
            if (place, key) not in self._filled:
                yield f"{place}: {_depends(key, next(iter(whys.values())))}"


def _depends(key: str, why: str) -> str:
    shown = "what may be a secret" if quotes_secret(why) else why
    return f"{'whether it applies' if key == 'if' else f'`{key}`'} depends on {shown}"


_SECRET = re.compile(
    r"(?<!com)(?<!by)(?<!low)(?<!low_)(?<!high)(?<!high_)(?<!band)(?<!band_)pass(?![a-z])|passwd|password|passphrase|pwd|secret|token|credential|vault|psk"
    r"|(?<![a-z])(key|pin|auth)(?![a-z])|(api|access|private|auth)_?key|(?-i:[a-z]Key)",
    re.I,
)
_QUOTED = re.compile(r"[`\"]([^`\"]*)[`\"]")
_IN_ADDRESS = re.compile(r"//[^/\s@]*:[^/\s@]*@")  # account:password@host
_MAVLINK = re.compile(r"(?:udp|tcp)[a-z-]*://[\d.]*:\d{1,5}@")  # udp://:14540@host has a port there


def quotes_secret(text: str) -> bool:
    """Returns True if a message quotes what may hold a secret."""
    if "`" in text and is_secret(text.replace("no key in", ""), text):
        return True
    return any(is_secret(one, one) for one in _QUOTED.findall(text))


def is_secret(name: str, value: str) -> bool:
    """Returns True if a variable of this name, or with this value, may hold a secret."""
    if value.lower() in ("true", "false"):
        return False
    return bool(
        _SECRET.search(name) or _IN_ADDRESS.search(_MAVLINK.sub("", value)) or "PRIVATE KEY-----" in value
    )
