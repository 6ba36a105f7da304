"""Private keys that lie beside a spec: found by name, known by their first line, never read further."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

from swarmctl.yamltext.files import content
from swarmctl.yamltext.project_files import ProjectFiles

_NAMES = re.compile(r"id_(rsa|dsa|ecdsa|ed25519)|.*\.(pem|key)")
_FOLDERS = ("", "ssh", "keys")
_FIRST_LINE = b"PRIVATE KEY-----"
_MOST = 1000  # files that are looked into


def private_keys_in(folder: Path, files: ProjectFiles) -> tuple[str, ...]:
    """Those of ``folder`` itself, and of its folders that people put keys into."""
    named = islice(_named(folder, files), _MOST)
    return tuple(str(Path(place, name)) for place, name in named if _is_key(folder / place / name))


def _named(folder: Path, files: ProjectFiles) -> Iterator[tuple[str, str]]:
    for place in _FOLDERS:
        yield from ((place, name) for name in files.names(folder / place) if _NAMES.fullmatch(name))


def _is_key(path: Path) -> bool:
    try:
        return not path.is_symlink() and _FIRST_LINE in content(path, 100)
    except OSError:
        return False
