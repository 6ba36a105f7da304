"""What another mode changes beyond the text of a spec: masters, programs and commanders. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from swarmctl.swarm.authority import OWN, Authority
from swarmctl.swarm.index import SwarmIndex
from swarmctl.yamltext.comments import lost_comments


def effects(before: SwarmIndex, after: SwarmIndex) -> Iterator[str]:
    """Yields what a reader of the new text cannot see in it, one sentence each."""
    yield from _masters(before, after)
    yield from _programs(before, after)
    yield from _commanders(before, after)
    if before.spec.islands and before.spec.islands != after.spec.islands:
        yield f"converting back does not restore the islands {_names(before.spec.islands)}"
    source, new = before.document.source, after.document.source
    for line, comment in lost_comments(source.text, new.text):
        yield f"{source.path}:{line}: the comment of a removed key is gone: {comment}"


def _masters(before: SwarmIndex, after: SwarmIndex) -> Iterator[str]:
    """The master of the one island, where there is one in both modes."""
    if len(before.islands) == len(after.islands) == 1 and before.islands[0].hub != after.islands[0].hub:
        yield f"the master runs on `{after.islands[0].hub}` instead of `{before.islands[0].hub}`"


def _programs(before: SwarmIndex, after: SwarmIndex) -> Iterator[str]:
    for name, program in before.spec.programs.items():
        old, new = before.program_hosts[name], after.program_hosts.get(name)
        if old == new or old is None or new is None:
            continue
        lacks = [need for need in program.needs if need not in after.spec.hosts[new].has]
        hint = f", which has no {_names(lacks)}" if lacks else ""
        yield f"program `{name}` runs on `{new}` instead of `{old}`{hint}"


def _commanders(before: SwarmIndex, after: SwarmIndex) -> Iterator[str]:
    """Who may command robots now and could not before, and the reverse: by commander, all its robots."""
    old, new = _commands(before), _commands(after)
    for (name, own), robots in new.items():
        gained = [robot for robot in robots if robot not in old.get((name, own), ())]
        if gained and own:
            yield f"the own programs of {_names(gained)} may command their robots"
        elif gained:
            yield f"`{name}` may command {_names(gained)}"
    for (name, own), robots in old.items():
        lost = [robot for robot in robots if robot not in new.get((name, own), ())]
        if lost and own:
            yield f"the own programs of {_names(lost)} may no longer command their robots"
        elif lost:
            yield f"`{name}` may no longer command {_names(lost)}"


def _commands(index: SwarmIndex) -> dict[tuple[str, bool], list[str]]:
    """The robots of every commander; those whose own programs command them are under ``("", True)``."""
    authority = Authority(index)
    found: dict[tuple[str, bool], list[str]] = {}
    for robot in index.spec.robots:
        for one in authority.over(robot):
            own = one.priority == OWN
            robots = found.setdefault(("" if own else one.name, own), [])
            if robot not in robots:
                robots.append(robot)
    return found


def _names(names: Iterable[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)
