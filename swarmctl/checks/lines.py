"""A robot's line carries what its driver asks of it, in time for the dead-man."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace

from swarmctl.checks.case import Case, Rule
from swarmctl.spec.diagnostics import Diagnostic, Fix, Note, Severity, Span
from swarmctl.spec.edits import mend, rename_key, replace_value, set_key
from swarmctl.spec.model import Serial
from swarmctl.spec.settings import DIAGNOSTICS
from swarmctl.spec.suggest import did_you_mean, nearest
from swarmctl.topology.interfaces import COMMAND
from swarmctl.topology.lines import CAREFUL, COMMAND_RATE, FTDI, LineBudget, Load, command_rates
from swarmctl.topology.names import namespace

# What terminals know (termios(3)), from 300 on.
BAUDS = (
    300, 600, 1200, 1800, 2400, 4800, 9600, 19200, 38400, 57600, 115200, 230400, 460800, 500000, 576000,
    921600, 1000000, 1152000, 1500000, 2000000, 2500000, 3000000, 3500000, 4000000,
)  # fmt: skip
_MOST_TIMEOUT = 2.0  # s that a robot may be left without an order
_PERIODS = 2  # orders that may be late before a robot stops for it


def full_lines(case: Case) -> Iterator[Diagnostic]:
    """LINE001, LINE002: the exchanges of a second fit into a second, with room for late replies."""
    for index, budget in case.line_budgets.items():
        load = budget.load
        if load.share > CAREFUL:
            yield _too_much(case, index, budget)


def _too_much(case: Case, index: int, budget: LineBudget) -> Diagnostic:
    load, robot = budget.load, budget.robot
    never = load.least_share > 1
    asked = ", ".join(f"{one.name} {one.rate:g} Hz" for one in load.exchanges)
    figures = (
        f"{load.needed:.0f} of {load.available:.0f} B/s, and {sum(one.rate for one in load.exchanges):g} "
        f"replies a second to wait for"
    )
    share = load.least_share if never else load.share
    verdict = "cannot carry" if never else "may not keep up with" if load.share > 1 else "is almost full with"
    return Diagnostic(
        "LINE001" if never else "LINE002",
        f"the line of `{robot}` {verdict} what is asked of it: {share:.0%} of its time ({figures})",
        _place(case, index, robot),
        severity=Severity.ERROR if never else Severity.WARNING,
        label=asked,
        notes=(Note(case.span("links", index), f"{load.kind} at {load.baud} baud"),),
        help=tuple(_mends(load)),
        fix=_fix(case, robot, load),
    )


def _place(case: Case, index: int, robot: str) -> Span:
    """Where the rates stand that are too high, else the line."""
    if case.spec.robots[robot].settings.rates:
        return case.span("robots", robot, "settings", "rates")
    if case.spec.defaults.robot.rates:
        return case.span("defaults", "robot", "rates")
    link = case.spec.links[index]
    return case.span("links", index, "baud" if isinstance(link, Serial) and link.baud else "robot")


def _mends(load: Load) -> Iterator[str]:
    fitting = load.fitting()
    if fitting:
        yield f"these fit: settings: {{rates: {{{_written(fitting)}}}}}"
    elif not load.slowest:
        yield "the orders alone are too much for it; a faster line is needed"
    if slow := load.slowest:
        yield f"`{slow.name}` less often helps most: each answer may hold the line for {slow.wait:.2g} s"
    if load.baud < 115200 and load.kind != "bluetooth":
        yield "or raise `baud`, here and on the robot"
    if load.kind == "usb" and replace(load, kind="usb-ftdi").share <= CAREFUL:
        yield f'or, if its adapter is of FTDI, say `vendor: "{FTDI}"`: a deploy sets its timer to 1 ms'


def _written(rates: dict[str, float]) -> str:
    return ", ".join(f"{name}: {rate:g}" for name, rate in rates.items())


def _fix(case: Case, robot: str, load: Load) -> Fix | None:
    """Lower rates in the robot's own settings, where it has rates of its own."""
    fitting, rates = load.fitting(), ("robots", robot, "settings", "rates")
    own = case.spec.robots[robot].settings.rates
    if not fitting or not own:
        return None
    changes = [set_key(case.document.source, rates, name, fitting[name]) for name in fitting if name in own]
    return mend(f"lower the rates of `{robot}` to {_written(fitting)}", *changes) if changes else None


def hasty_dead_men(case: Case) -> Iterator[Diagnostic]:
    """LINE003: a robot waits longer for an order than orders and its line take to bring one."""
    ordered = command_rates(case.spec, case.endpoints)
    for budget in case.line_budgets.values():
        timeout = case.command_timeouts[budget.robot]
        period = 1 / ordered.get(budget.robot, COMMAND_RATE)
        load = budget.load
        least = max(_PERIODS * period, load.cycle)
        if timeout >= least or load.least_share > 1 or timeout <= load.reply_timeout:  # LINE001, LINE006
            continue
        slow = "two orders take" if least > load.cycle else "one turn of all requests takes"
        yield Diagnostic(
            "LINE003",
            f"robot `{budget.robot}` stops after {timeout:g} s without an order, and {slow} {least:.2g} s",
            _timeout_place(case, budget.robot),
            severity=Severity.WARNING,
            label="one late order stops the robot",
            notes=tuple(_slow_commanders(case, budget.robot)),
            help=(f"order more often, or allow at least `command_timeout: {least:.2g}` (2 at most)",),
        )


def _timeout_place(case: Case, robot: str) -> Span:
    own = case.spec.robots[robot].settings
    if own.command_timeout is not None:
        return case.span("robots", robot, "settings", "command_timeout")
    return case.span("robots", robot, key=True)


def _slow_commanders(case: Case, robot: str) -> Iterator[Note]:
    topic = f"{namespace(robot)}/{COMMAND}"
    for one in case.endpoints:
        if one.publishes and one.topic == topic and one.rate is not None:
            yield Note(case.span(*one.loc, "rate"), f"`{one.owner}` orders at {one.rate:g} Hz")


def stubborn_replies(case: Case) -> Iterator[Diagnostic]:
    """LINE006: a reply that is awaited holds up no stop that is due by then."""
    for budget in case.line_budgets.values():
        robot, timeout = budget.robot, case.command_timeouts[budget.robot]
        if timeout > budget.load.reply_timeout:
            continue
        yield Diagnostic(
            "LINE006",
            f"robot `{robot}` stops after {timeout:g} s without an order, and its driver may wait "
            f"{budget.load.reply_timeout:g} s for one reply",
            case.span(*(case.said_timeout(robot) or ("robots", robot, "type"))),
            label="a lost reply would hold up the stop",
            help=(
                f"write a `command_timeout` above {budget.load.reply_timeout:g}",
                f"or lower `reply_timeout` in the type `{case.spec.robots[robot].type}`",
            ),
        )


def slow_replies(case: Case) -> Iterator[Diagnostic]:
    """LINE007: what takes as long as the dead-man is read only while the robot stands."""
    for budget in case.line_budgets.values():
        slow, timeout = budget.load.slowest, case.command_timeouts[budget.robot]
        if slow is None or slow.wait < timeout:
            continue
        more = f"; or allow a `command_timeout` above {slow.wait:.2f}" if slow.wait < _MOST_TIMEOUT else ""
        yield Diagnostic(
            "LINE007",
            f"robot `{budget.robot}` is asked for `{slow.name}` only while it stands: the answer may take "
            f"{slow.wait:.2f} s, and without an order it has to stop after {timeout:g} s",
            _rate_said(case, budget.robot, slow.name),
            severity=Severity.WARNING,
            label="none while it drives",
            help=(f"a shorter answer takes less, such as smaller images{more}",),
        )


def _rate_said(case: Case, robot: str, sensor: str) -> Span:
    """Where a sensor is turned on: in a robot's own settings, for all robots, or in its type."""
    if sensor in case.spec.robots[robot].settings.rates:
        return case.span("robots", robot, "settings", "rates", sensor)
    if sensor in case.spec.defaults.robot.rates:
        return case.span("defaults", "robot", "rates", sensor)
    return case.span("robots", robot, "type")


def odd_bauds(case: Case) -> Iterator[Diagnostic]:
    """LINE004: a speed that ports know; another one is most often a slip of the finger."""
    for index, link in case.lines:
        if isinstance(link, Serial) and link.baud is not None and link.baud not in BAUDS:
            spoken = case.types[case.spec.robots[link.robot].type].link
            near = nearest_baud(link.baud, (spoken.baud, *spoken.other_bauds))
            yield Diagnostic(
                "LINE004",
                f"{link.baud} baud is no speed that serial ports have by name",
                case.span("links", index, "baud"),
                severity=Severity.WARNING,
                label=f"the line of `{link.robot}`",
                help=(f"did you mean {near}?",),
                fix=mend(
                    f"write {near}", replace_value(case.document.source, ("links", index, "baud"), near)
                ),
            )


def nearest_baud(baud: int, known: Sequence[int] = BAUDS) -> int:
    """The one nearest in proportion among those that are ``known``."""
    return min(known, key=lambda one: max(one / baud, baud / one))


def unknown_rates(case: Case) -> Iterator[Diagnostic]:
    """LINE005: a rate is for what the robot's type senses; one for all robots, for what some do."""
    everything = {sensor: None for one in case.types.values() for sensor in one.sensors}
    for sensor in case.spec.defaults.robot.rates:
        if sensor not in everything and sensor != DIAGNOSTICS:
            yield _no_such_sensor(case, ("defaults", "robot"), sensor, "no robot", everything)
    for name, robot in case.spec.robots.items():
        for sensor in robot.settings.rates:
            kind = case.types.get(robot.type)
            if kind is not None and sensor not in kind.sensors and sensor != DIAGNOSTICS:
                who = f"robot `{name}` is a {robot.type}, which"
                yield _no_such_sensor(case, ("robots", name, "settings"), sensor, who, kind.sensors)


def _no_such_sensor(
    case: Case, place: tuple[str, ...], sensor: str, who: str, sensors: Collection[str]
) -> Diagnostic:
    known = (*sensors, DIAGNOSTICS)
    loc, near = (*place, "rates", sensor), nearest(sensor, known)
    return Diagnostic(
        "LINE005",
        f"{who} senses no `{sensor}`",
        case.span(*loc, key=True),
        label="no such sensor",
        help=did_you_mean(sensor, known, "there are"),
        fix=mend(f"rename it to `{near}`", rename_key(case.source, loc, near)) if near else None,
    )


RULES: tuple[Rule, ...] = (
    full_lines, hasty_dead_men, odd_bauds, unknown_rates, stubborn_replies, slow_replies,
)  # fmt: skip
