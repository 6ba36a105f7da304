"""What of launch files depends on a substitution whose value only the host has."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

from swarmctl.importing.draft import Value
from swarmctl.ros_packages.launched import Place


class Unknown:
    """The attributes of launch files that depend on a substitution; each is to fill in, or not read."""

    def __init__(self, reasons: Mapping[tuple[Place, str], str]) -> None:
        self._reasons = reasons
        self._filled: set[tuple[Place, str]] = set()

    def has(self, place: Place, *keys: str) -> bool:
        """Returns True if one of these attributes depends on a substitution."""
        return any((place, key) in self._reasons for key in keys)

    def filled(self, value: Value, place: Place, *keys: str) -> Value:
        """Returns a value that is to fill in if one of these attributes depends on a substitution."""
        for key in keys:
            if why := self._reasons.get((place, key)):
                self._filled.add((place, key))
                value = replace(value, fill_in=f"{place}: {_depends(key, why)}")
        return value

    def unread(self) -> Iterator[str]:
        """Yields the places that are not to fill in."""
        for (place, key), why in self._reasons.items():
            if (place, key) not in self._filled:
                yield f"{place}: {_depends(key, why)}"


def _depends(key: str, why: str) -> str:
    return f"{'whether it applies' if key == 'if' else f'`{key}`'} depends on {why}"
