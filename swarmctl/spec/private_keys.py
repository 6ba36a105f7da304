"""Private keys that lie beside a spec: found by name, known by their first line, never read further."""

from __future__ import annotations

import os
import re
from itertools import islice
from pathlib import Path

_NAMES = re.compile(r"id_(rsa|dsa|ecdsa|ed25519)|.*\.(pem|key)")
_FOLDERS = ("", "ssh", "keys")
_FIRST_LINE = b"PRIVATE KEY-----"
_MOST_ENTRIES = 1000  # of a folder; what holds more is no folder of a spec


def private_keys_in(folder: Path) -> tuple[str, ...]:
    """Those of ``folder`` itself, and of its folders that people put keys into."""
    return tuple(str(Path(place, name)) for place in _FOLDERS for name in _names_in(folder / place))


def _names_in(folder: Path) -> list[str]:
    try:
        with os.scandir(folder) as entries:
            named = [one for one in islice(entries, _MOST_ENTRIES) if _NAMES.fullmatch(one.name)]
            files = sorted(one.name for one in named if one.is_file(follow_symlinks=False))
    except OSError:
        return []
    return [name for name in files if _is_key(folder / name)]


def _is_key(path: Path) -> bool:
    try:
        with path.open("rb") as file:
            return _FIRST_LINE in file.read(100)
    except OSError:
        return False
