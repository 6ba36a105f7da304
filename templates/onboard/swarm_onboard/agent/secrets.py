"""The secrets of a swarm: sets of files below /etc/swarm, for root alone. No record or answer holds a value.

A set is complete, never changes, and has the name of the change that brought it. A link leads to the current
one: a change switches it as it switches the release, and an undo switches it back.
"""

from __future__ import annotations

import os
from contextlib import suppress

from . import files, json_text
from .errors import RefusedError
from .failpoint import passed
from .manifest import is_release_name, secret_names
from .paths import KEPT
from .release_store import Home

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Iterable

    from .messages import SecretState

_SETS = "secret-sets"


def _link(home: Home) -> str:
    return home.outside(f"{KEPT}/{home.swarm}/secrets")


def _folder(home: Home, name: str = "") -> str:
    return os.path.join(os.path.dirname(_link(home)), _SETS, name)


def offered(payload: bytes) -> dict[str, bytes]:
    """Returns the secrets in a payload, by name. Raises ``RefusedError``."""
    values = json_text.loads(payload.decode("utf-8")) if payload else {}
    if not isinstance(values, dict) or not all(isinstance(one, str) for one in values.values()):
        raise RefusedError("not secrets of swarmctl", "are swarmctl and its agent of one version?")
    return {name: values[name].encode("utf-8") for name in secret_names(list(values))}


def states(home: Home, names: Iterable[str], values: dict[str, bytes]) -> dict[str, SecretState]:
    """By name: ``same``, ``other`` or ``new`` if a value is offered; without one ``kept`` or ``missing``."""
    found: dict[str, SecretState] = {}
    for name in names:
        kept = files.read(f"{_link(home)}/{name}")
        if name not in values:
            found[name] = "missing" if kept is None else "kept"
        else:
            found[name] = "new" if kept is None else "same" if kept == values[name] else "other"
    return found


def current(home: Home) -> str:
    """Returns the name of the current set; empty if there is none."""
    folder, _, name = (files.pointed(_link(home)) or "").rpartition("/")
    return name if folder == _SETS and is_release_name(name) else ""


def sets(home: Home) -> list[str]:
    """Returns the names of the stored sets."""
    try:
        return sorted(os.listdir(_folder(home)))
    except FileNotFoundError:
        return []


def differing(home: Home, one: str, other: str) -> set[str]:
    """Returns the names of the secrets that differ between two sets."""
    first, second = _values(home, one), _values(home, other)
    return {name for name in {*first, *second} if first.get(name) != second.get(name)}


def check(home: Home) -> None:
    """Raises ``RefusedError`` if a folder stands where the link to the current set belongs."""
    if os.path.isdir(_link(home)) and not os.path.islink(_link(home)):
        raise RefusedError(
            f"{_link(home)} is a folder, and swarmctl needs a link there",
            "move it away; a deploy brings the secrets that are beside the spec",
        )


def store(home: Home, txid: str, names: Iterable[str], values: dict[str, bytes]) -> str:
    """Returns the set of the secrets ``names``: their new ``values``, else those of the current set.

    One that is equal to the current set is that set; another is written to the disk as ``txid``. Raises
    ``OSError``; ``forget`` removes what was written by then.
    """
    before = _values(home, current(home))
    wanted = {name: values.get(name, before.get(name)) for name in names}
    content = {name: value for name, value in wanted.items() if value is not None}
    if content == before or not content:
        return current(home) if content else ""
    os.makedirs(os.path.dirname(_link(home)), 0o755, exist_ok=True)
    os.makedirs(_folder(home), 0o700, exist_ok=True)
    os.mkdir(_folder(home, txid), 0o700)
    for name, value in content.items():
        files.write_new(_folder(home, f"{txid}/{name}"), value, 0o600)
    passed("secrets")
    files.sync_disk(_folder(home))
    return txid


def point(home: Home, name: str) -> None:
    """Makes the set ``name`` the current one; none if it is empty."""
    link = _link(home)
    if name:
        os.makedirs(os.path.dirname(link), 0o755, exist_ok=True)
        files.point(link, f"{_SETS}/{name}")
    elif os.path.isdir(os.path.dirname(link)):
        files.remove(files.draft(link))
        files.remove(link)
        files.sync(os.path.dirname(link))


def forget(home: Home, but: Iterable[str] = ()) -> None:
    """Removes every set that is not named, and empty folders."""
    for name in set(sets(home)) - set(but):
        files.remove_tree(_folder(home, name))
    with suppress(OSError):
        os.rmdir(_folder(home))
        os.rmdir(os.path.dirname(_link(home)))
        os.rmdir(home.outside(KEPT))


def _values(home: Home, name: str) -> dict[str, bytes]:
    """The secrets of a set, by name; none without a set."""
    folder = _folder(home, name)
    found = os.listdir(folder) if name and os.path.isdir(folder) else []
    return {one: files.read(f"{folder}/{one}") or b"" for one in found}
