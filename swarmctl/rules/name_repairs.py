"""How names that are not defined, and hosts that a mode lacks, can be repaired."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence

from swarmctl.spec import model
from swarmctl.spec.load import Document
from swarmctl.spec.model import Mode
from swarmctl.spec.recovery import Ways
from swarmctl.spec.references import mentioned
from swarmctl.suggest import nearest
from swarmctl.swarm.modes import ROLES
from swarmctl.yamltext.source import Loc
from swarmctl.yamltext.tree_changes import REMOVED, Change

_MOST = 6  # names that are tried in one place
_ELSEWHERE = "elsewhere"  # a host that what could not be read may define


def name_faults(
    document: Document, note: Callable[[Collection[str], str], None], *, whole: bool
) -> Iterator[Ways]:
    """Yields the ways to repair each name that is not defined, and each host that is missing.

    ``note`` receives each unknown name, and the sections that could define it. If the spec is not ``whole``,
    what could not be read may define it.
    """
    yield from _unknown(document, note, whole=whole)
    elsewhere = () if whole else (_ELSEWHERE,)
    yield from _roles((), document.spec, (*elsewhere, *document.spec.hosts))
    if document.spec.mode is Mode.COMBINED:
        for name, island in document.spec.islands.items():
            yield from _roles(("islands", name), island, island.hosts)
    if document.spec.mode is not Mode.SINGLE_MINDED:
        for name, robot in document.spec.robots.items():
            if robot.host is None:
                yield [[Change(("robots", name, "host"), value=host)] for host in _some(document.spec.hosts)]


def hosts_elsewhere(name: str) -> list[dict[str, object]]:
    """Returns what a host may be that is defined in a file that could not be read."""
    return [{"address": f"{name}.local"}, {"address": "192.168.254.77", "bluetooth": ["hci0"]}]


def robots_elsewhere(hosts: Sequence[str]) -> list[dict[str, object]]:
    """Returns what a robot may be that is defined in such a file."""
    return [{"type": "khepera3", "host": hosts[0]}, {"type": "epuck", "host": hosts[-1]}]


def _unknown(
    document: Document, note: Callable[[Collection[str], str], None], *, whole: bool
) -> Iterator[Ways]:
    spec = document.spec
    known: dict[str, Collection[str]] = {
        "hosts": spec.hosts, "robots": spec.robots, "programs": spec.programs,
        "types": document.types, "computers": document.computers,
    }  # fmt: skip
    for kinds, places in mentioned(document.source.data, known):
        names = dict.fromkeys(name for kind in kinds for name in known[kind])
        unknown = [(loc, name) for loc, name in places if name not in names]
        if not unknown:
            continue
        mentions = {name for _, name in places}
        rare = [one for one in names if one not in mentions]  # a name that nothing mentions is likely meant
        common = [one for one in names if one in mentions]
        words = tuple(names)
        turns = {name: turn for turn, name in enumerate(dict.fromkeys(name for _, name in unknown))}
        for loc, name in unknown:
            note(kinds, name)
            near = nearest(name, words)
            turn = turns[name] % len(rare) if rare else 0
            others = [one for one in (*rare[turn:], *rare[:turn], *common) if one != near]
            ways = [[Change(loc, value=one)] for one in _some([*([near] if near else []), *others])]
            elsewhere = [] if whole else _added(kinds[-1], name, tuple(spec.hosts))
            yield elsewhere or ways or [[Change(loc, value=REMOVED)]]


def _added(section: str, name: str, hosts: Sequence[str]) -> list[list[Change]]:
    """Returns the ways to define an unknown host or robot; none for other names."""
    entries = {"hosts": hosts_elsewhere(name), "robots": robots_elsewhere(hosts)}
    return [[Change((section, name), value=one)] for one in entries.get(section, ())]


def _some(names: Iterable[str]) -> list[str]:
    return list(names)[:_MOST]


def _roles(loc: Loc, within: model.Spec | model.Island, hosts: Collection[str]) -> Iterator[Ways]:
    role = ROLES.get(Mode(within.mode))
    named = [key for key in ("leader", "hub") if getattr(within, key) is not None]
    wrong = [key for key in named if role is None or key != role.key]
    if role is not None and role.key not in named and not wrong:
        yield [[Change((*loc, role.key), value=host)] for host in _some(hosts)]
    for number, key in enumerate(wrong):
        at = (*loc, key)
        meant = role is not None and role.key not in named and number == 0
        yield [[Change(at, key=role.key) if role and meant else Change(at, value=REMOVED)]]
