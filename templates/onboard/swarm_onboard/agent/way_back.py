"""The units that a rollback stops, starts, restarts and reloads."""

from __future__ import annotations

from . import secrets
from .manifest import release_name
from .named_tuple import NamedTuple

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .release_store import Home


class UnitsBack(NamedTuple):
    """The units that a rollback stops, starts, restarts and reloads."""

    stop: list[str]
    start: list[str]
    restart: list[str]
    reload: list[str]


def units(home: Home, release: str, chosen: str) -> UnitsBack:
    """Returns what changes from the current release to another one with the set ``chosen`` of secrets."""
    before = {unit["name"]: unit for unit in home.units(home.current())}
    after = {unit["name"]: unit for unit in home.units(release_name(release))}
    others = secrets.differing(home, secrets.current(home), chosen and release_name(chosen))
    changed = [
        unit
        for unit, one in after.items()
        if unit in before
        and (one["digest"] != before[unit]["digest"] or others & set(one.get("secrets", ())))
    ]
    reload = [
        unit
        for unit in changed
        if before[unit].get("fixed", "") == after[unit].get("fixed")
        and not others & set(after[unit].get("secrets", ()))
    ]
    return UnitsBack(
        stop=[unit for unit in before if unit not in after],
        start=[unit for unit in after if unit not in before],
        restart=[unit for unit in changed if unit not in reload],
        reload=reload,
    )
