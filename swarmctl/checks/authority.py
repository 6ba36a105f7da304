"""Who may command whom: one owner per robot at a time; and what tells mode `leader` from `central`."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.checks.case import Case, Rule
from swarmctl.spec.diagnostics import Diagnostic, Fix, Note, Severity
from swarmctl.spec.edits import append_item, mend, remove, set_key
from swarmctl.spec.model import Mode
from swarmctl.topology import names
from swarmctl.topology.bridges import commanders_host
from swarmctl.topology.interfaces import COMMAND, COMMAND_TYPE
from swarmctl.topology.networks import advertised


def led_by_others(case: Case) -> Iterator[Diagnostic]:
    """AUTH001: where a leader leads, nobody else of its island commands."""
    spec = case.spec
    leaders = _leaders(case)
    for index, control in enumerate(spec.control if leaders else ()):
        host = commanders_host(spec, control.by) or ""
        home = case.home.get(host)
        if home is None or leaders.get(home.name, host) == host:
            continue
        leader = leaders[home.name]
        of = next((one for one in control.of if _island_of(case, one) == home.name), None)
        if of is None:
            continue
        where = f" on `{host}`" if host != control.by else ""
        loc = ("leader",) if spec.mode is Mode.LEADER else ("islands", home.name, "leader")
        yield Diagnostic(
            "AUTH001",
            f"`{control.by}`{where} commands `{of}`, but in mode `leader` only `{leader}` commands",
            case.span("control", index, "by"),
            label="not the leader",
            notes=(Note(case.span(*loc), "the leader"),),
            help=(
                f"if others may command too, this is mode `central`: write it, and `hub: {leader}`",
                f"else let a program on `{leader}` command it",
            ),
        )


def _leaders(case: Case) -> dict[str, str]:
    """The leader of every island in mode leader, by the island's name."""
    spec = case.spec
    if spec.mode is Mode.LEADER:
        return {island.name: island.hub for island in case.islands}
    if spec.mode is not Mode.COMBINED:
        return {}
    return {one.name: one.hub for one in case.islands if spec.islands[one.name].mode == Mode.LEADER.value}


def _island_of(case: Case, robot: str) -> str | None:
    home = case.home.get(case.driving[robot] or "")
    return home.name if home is not None else None


def rivals(case: Case) -> Iterator[Diagnostic]:
    """AUTH002, AUTH003: two commanders of one robot with one priority; one that is named twice."""
    first: dict[str, list[tuple[str, int, int, int]]] = {}
    for index, control in enumerate(case.spec.control):
        for place, robot in enumerate(control.of):
            earlier = first.setdefault(robot, [])
            for by, priority, other, there in earlier:
                if other == index or (by != control.by and priority != control.priority):
                    continue
                rival = by != control.by
                yield Diagnostic(
                    "AUTH002" if rival else "AUTH003",
                    f"`{by}` and `{control.by}` command robot `{robot}` with one priority, {priority}"
                    if rival
                    else f"`{by}` is said to command robot `{robot}` twice",
                    case.span("control", index, "of", place),
                    severity=Severity.ERROR if rival else Severity.WARNING,
                    label="whose orders hold?" if rival else "a second time",
                    notes=(Note(case.span("control", other, "of", there), "first here"),),
                    help=(f"give the one who shall win a higher priority: priority: {priority + 1}",)
                    if rival
                    else ("keep one of the two",),
                    fix=None if rival else _once(case, index, place),
                )
                break
            earlier.append((control.by, control.priority, index, place))


def _once(case: Case, index: int, place: int) -> Fix | None:
    alone = len(case.spec.control[index].of) == 1
    loc = ("control", index) if alone else ("control", index, "of", place)
    return mend("remove the second one", remove(case.source, loc))


def unannounced(case: Case) -> Iterator[Diagnostic]:
    """AUTH004: a program sends a robot orders, and neither `control` nor the mode lets it."""
    spec = case.spec
    for one in case.endpoints:
        space, _, name = one.topic.rpartition("/")
        if not one.publishes or name != COMMAND or space not in case.publishers.robots:
            continue
        robot = case.publishers.robots[space]
        address = advertised(spec, one.host) if one.host in spec.hosts else ""
        if any(commander.includes(one.node, address) for commander in case.authority.over(robot)):
            continue
        listed = sorted(control.by for control in spec.control if robot in control.of)
        entry = {"by": one.owner, "of": [robot]}
        made = (
            append_item(case.source, ("control",), entry)
            if spec.control
            else set_key(case.source, (), "control", [entry])
        )
        listing = f"{{by: {one.owner}, of: [{robot}]"
        yield Diagnostic(
            "AUTH004",
            f"program `{one.owner}` sends orders to robot `{robot}`, and nothing lets it",
            case.span(*one.loc, "topic"),
            label=f"the orders of `{robot}`",
            notes=(Note(case.span("control", key=True), "who may command whom"),) if spec.control else (),
            help=(
                f"add to `control`: {listing}, priority: ...}}; "
                f"`{'`, `'.join(listed)}` may command `{robot}` already"
                if listed
                else f"add to `control`: {listing}}}",
            ),
            fix=None if listed else mend(f"let `{one.owner}` command `{robot}`", made),
        )


def mute_commanders(case: Case) -> Iterator[Diagnostic]:
    """AUTH005: a program that is to command a robot says what it publishes, and orders are not among it."""
    spec = case.spec
    said: dict[str, set[str]] = {}
    for one in case.endpoints:
        if one.publishes:
            said.setdefault(one.owner, set()).add(one.topic)
    for index, control in enumerate(spec.control if said else ()):
        if control.by not in said:
            continue
        for place, robot in enumerate(control.of):
            topic = f"{names.namespace(robot)}/{COMMAND}"
            if topic not in said[control.by]:
                yield Diagnostic(
                    "AUTH005",
                    f"`{control.by}` is to command robot `{robot}`, but does not publish `{topic}`",
                    case.span("control", index, "of", place),
                    severity=Severity.WARNING,
                    label="gets no orders",
                    notes=(
                        Note(case.span("programs", control.by, "publishes", key=True), "what it publishes"),
                    ),
                    help=(f"add {{topic: {topic}, type: {COMMAND_TYPE}}} there, or remap to it",),
                )


def silent_commanders(case: Case) -> Iterator[Diagnostic]:
    """AUTH006: a commander on a host that runs no ROS."""
    for index, control in enumerate(case.spec.control if case.islands else ()):
        host = commanders_host(case.spec, control.by)
        if host is not None and host in case.spec.hosts and host not in case.home:
            yield Diagnostic(
                "AUTH006",
                f"`{control.by}` cannot command: host `{host}` runs no ROS",
                case.span("control", index, "by"),
                label="in mode `single-minded` the leader runs everything",
                help=("let the leader command, or choose another mode",),
            )


def ambiguous_commanders(case: Case) -> Iterator[Diagnostic]:
    """AUTH007: a commander's name is that of two things on different hosts."""
    spec = case.spec
    for index, control in enumerate(spec.control):
        kinds = [kind for kind in ("programs", "robots", "hosts") if control.by in getattr(spec, kind)]
        if len(kinds) < 2 or commanders_host(spec, control.by) == control.by:
            continue
        first, second = (kind[:-1] for kind in kinds[:2])
        yield Diagnostic(
            "AUTH007",
            f"`{control.by}` is a {first} and a {second}; which of them commands?",
            case.span("control", index, "by"),
            label="two things of one name",
            notes=tuple(Note(case.span(kind, control.by, key=True), f"a {kind[:-1]}") for kind in kinds[:2]),
            help=("rename one of the two",),
        )


def unguarded(case: Case) -> Iterator[Diagnostic]:
    """AUTH008: several may command a robot whose driver cannot tell them apart; one finding a robot."""
    spec = case.spec
    foreign = {name for name, one in spec.robots.items() if case.types[one.type].foreign(one.driver)}
    first: dict[str, tuple[str, int, int]] = {}
    told: set[str] = set()
    for index, control in enumerate(spec.control if foreign else ()):
        for place, robot in enumerate(control.of):
            if robot not in foreign or robot in told:
                continue
            by, other, there = first.setdefault(robot, (control.by, index, place))
            if by == control.by:
                continue
            told.add(robot)
            yield Diagnostic(
                "AUTH008",
                f"robot `{robot}` obeys `{by}` and `{control.by}` alike, whatever their priority",
                case.span("control", index, "of", place),
                severity=Severity.WARNING,
                label="rosserial_python takes orders from everybody",
                notes=(Note(case.span("control", other, "of", there), "first here"),),
                help=(f"let swarmctl drive it: take `driver` out of `{robot}`",),
            )


RULES: tuple[Rule, ...] = (
    led_by_others,
    rivals,
    unannounced,
    mute_commanders,
    silent_commanders,
    ambiguous_commanders,
    unguarded,
)
