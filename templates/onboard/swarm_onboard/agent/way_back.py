"""The steps of a rollback."""

from __future__ import annotations

from . import secrets
from .manifest import release_name
from .steps import Kind, Step

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .release_store import Home


def steps(home: Home, release: str, chosen: str) -> list[Step]:
    """Returns the steps from the current release to another one with the set ``chosen`` of secrets."""
    current = home.current()
    same = release == current
    cause = "with the secrets that it had before" if same else f"replaces {current}"
    why = "secrets that it reads change" if same else "its files or secrets differ"
    before = {unit["name"]: unit for unit in home.units(current)}
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
    return [
        *(Step(Kind.STOP, unit, f"not part of {release}") for unit in before if unit not in after),
        Step(Kind.ACTIVATE, release, cause),
        *(Step(Kind.RELOAD_UNIT, unit, "takes its file while it runs") for unit in reload),
        *(Step(Kind.RESTART, unit, why) for unit in changed if unit not in reload),
        *(Step(Kind.START, unit, f"part of {release}") for unit in after if unit not in before),
    ]
