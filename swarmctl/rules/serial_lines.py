"""The load of serial and Bluetooth links, and reply times against the dead-man timeout."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace

from swarmctl.analysis.serial_load import CAREFUL, SerialBudget, SerialLoad, command_rates
from swarmctl.diagnostics import Diagnostic, Fix, Note, Span
from swarmctl.links.serial_link import FTDI, Serial
from swarmctl.linter.context import RuleContext, rule
from swarmctl.robot_types.protocols import LineProtocol
from swarmctl.robot_types.settings import DIAGNOSTICS
from swarmctl.suggest import did_you_mean, guess, typing_errors
from swarmctl.yamltext.edits import make_fix, rename_key, replace_value, set_key

# The standard rates of termios(3), from 300.
BAUDS = (
    300, 600, 1200, 1800, 2400, 4800, 9600, 19200, 38400, 57600, 115200, 230400, 460800, 500000, 576000,
    921600, 1000000, 1152000, 1500000, 2000000, 2500000, 3000000, 3500000, 4000000,
)  # fmt: skip
_MOST_TIMEOUT = 2.0  # s, the largest command_timeout
_PERIODS = 2  # command periods within which a robot does not stop


@rule("LINE001", "LINE002")
def link_loads(context: RuleContext) -> Iterator[Diagnostic]:
    """A link whose exchanges take almost all of its time, or more."""
    for index, budget in context.line_budgets.items():
        load = budget.load
        if load.share > CAREFUL:
            yield _too_much(context, index, budget)


def _too_much(context: RuleContext, index: int, budget: SerialBudget) -> Diagnostic:
    load, robot = budget.load, budget.robot
    over = load.share > 1
    queries = ", ".join(f"{one.name} {one.rate:g} Hz" for one in load.exchanges)
    figures = (
        f"{load.needed:.0f} of {load.available:.0f} B/s, and {sum(one.rate for one in load.exchanges):g} "
        f"replies per second"
    )
    verdict = "is overloaded" if over else "is almost fully used"
    return Diagnostic(
        "LINE001" if over else "LINE002",
        f"the link of robot `{robot}` {verdict}: {load.share:.0%} of its time ({figures})",
        _place(context, index, robot),
        label=queries,
        notes=(Note(context.span("links", index), f"{load.kind} at {load.baud} baud"),),
        help=tuple(_remedies(load)),
        fix=_fix(context, robot, load),
    )


def _place(context: RuleContext, index: int, robot: str) -> Span:
    """Returns the place of the rates, or of the link if no rates are set."""
    if context.spec.robots[robot].settings.rates:
        return context.span("robots", robot, "settings", "rates")
    if context.spec.defaults.robot.rates:
        return context.span("defaults", "robot", "rates")
    link = context.spec.links[index]
    return context.span("links", index, "baud" if isinstance(link, Serial) and link.baud else "robot")


def _remedies(load: SerialLoad) -> Iterator[str]:
    fitting = load.fitting()
    if fitting:
        yield f"rates that fit: settings: {{rates: {{{_written(fitting)}}}}}"
    elif not load.slowest:
        yield "commands alone exceed its capacity; use a faster link"
    if slow := load.slowest:
        yield f"a lower rate of `{slow.name}` helps most: each reply may block the link for {slow.wait:.2g} s"
    if load.baud < 115200 and load.kind != "bluetooth":
        yield "or raise `baud` here and on the robot"
    if load.kind == "usb" and replace(load, kind="usb-ftdi").share <= CAREFUL:
        yield f'or, for an FTDI adapter, set `vendor: "{FTDI}"`; deploy then sets its latency timer to 1 ms'


def _written(rates: dict[str, float]) -> str:
    return ", ".join(f"{name}: {rate:g}" for name, rate in rates.items())


def _fix(context: RuleContext, robot: str, load: SerialLoad) -> Fix | None:
    """Returns the fix that lowers the rates in the robot's own settings, if it has any."""
    fitting, rates = load.fitting(), ("robots", robot, "settings", "rates")
    own = context.spec.robots[robot].settings.rates
    if not fitting or not own:
        return None
    changes = [set_key(context.document.source, rates, name, rate) for name, rate in fitting.items()]
    return make_fix(f"lower the rates of `{robot}` to {_written(fitting)}", *changes, safe=False)


@rule("LINE003")
def short_dead_man_timeouts(context: RuleContext) -> Iterator[Diagnostic]:
    """A dead-man timeout shorter than two command periods, or than one cycle of the link."""
    rates = command_rates(context, min)
    loads = {one.robot: one.load for one in context.line_budgets.values()}
    for robot in (*loads, *(one for one in context.ros_drivers if one in context.gated)):
        load, timeout = loads.get(robot), context.command_timeouts[robot]
        least = max(_PERIODS / rates[robot], load.cycle if load else 0)
        # LINE001, LINE006
        if timeout >= least or (load and (load.share > 1 or timeout <= load.reply_timeout)):
            continue
        slow = (
            "one cycle of all requests takes" if load and least == load.cycle else "two command periods take"
        )
        yield Diagnostic(
            "LINE003",
            f"robot `{robot}` stops after {timeout:g} s without a command, but {slow} {least:.2g} s",
            _timeout_place(context, robot),
            label="one late command stops the robot",
            notes=tuple(_slow_commanders(context, robot, _PERIODS / timeout)),
            help=(
                f"publish commands more often, or set at least `command_timeout: {least:.2g}` (at most 2)",
            ),
        )


def _timeout_place(context: RuleContext, robot: str) -> Span:
    own = context.spec.robots[robot].settings
    missing = own.command_timeout is None
    return context.span("robots", robot, "settings", "command_timeout", key=missing)


def _slow_commanders(context: RuleContext, robot: str, least: float) -> Iterator[Note]:
    command = context.command_topics.get(robot)
    for one in context.endpoints:
        ours = one.publishes and command is not None and one.topic == command.topic
        if ours and one.rate is not None and one.rate < least:
            yield Note(context.span(*one.loc, "rate"), f"`{one.owner}` publishes commands at {one.rate:g} Hz")


@rule("LINE006")
def long_reply_timeouts(context: RuleContext) -> Iterator[Diagnostic]:
    """A reply timeout that may delay a stop."""
    for budget in context.line_budgets.values():
        robot, timeout = budget.robot, context.command_timeouts[budget.robot]
        if timeout > budget.load.reply_timeout:
            continue
        yield Diagnostic(
            "LINE006",
            f"robot `{robot}` stops after {timeout:g} s without a command, but its driver may wait "
            f"{budget.load.reply_timeout:g} s for one reply",
            context.span(*(context.command_timeout_loc(robot) or ("robots", robot, "type"))),
            label="a lost reply would delay the stop",
            help=(
                f"write a `command_timeout` above {budget.load.reply_timeout:g}",
                f"or lower `reply_timeout` in the type `{context.spec.robots[robot].type}`",
            ),
        )


@rule("LINE007")
def slow_replies(context: RuleContext) -> Iterator[Diagnostic]:
    """A sensor reply that takes longer than the dead-man timeout."""
    for budget in context.line_budgets.values():
        slow, timeout = budget.load.slowest, context.command_timeouts[budget.robot]
        if slow is None or slow.wait < timeout:
            continue
        faster = context.native_robots[budget.robot].sensors[slow.sensors[0][0]].faster
        more = f", or set a `command_timeout` above {slow.wait:.2f}" if slow.wait < _MOST_TIMEOUT else ""
        yield Diagnostic(
            "LINE007",
            f"`{slow.name}` of robot `{budget.robot}` is read only while it stands: the reply may take "
            f"{slow.wait:.2f} s, the dead-man timeout is {timeout:g} s",
            _rate_place(context, budget.robot, slow.name),
            label="not read while it drives",
            help=(f"{faster}{more}",),
        )


def _rate_place(context: RuleContext, robot: str, sensor: str) -> Span:
    """Returns the place of a sensor's rate: in the robot's settings, in the defaults, or its type."""
    if sensor in context.spec.robots[robot].settings.rates:
        return context.span("robots", robot, "settings", "rates", sensor)
    if sensor in context.spec.defaults.robot.rates:
        return context.span("defaults", "robot", "rates", sensor)
    return context.span("robots", robot, "type")


@rule("LINE004")
def odd_bauds(context: RuleContext) -> Iterator[Diagnostic]:
    """A non-standard baud rate, usually a typing error."""
    for index, link in context.lines:
        if not isinstance(link, Serial) or link.baud is None or link.baud in BAUDS:
            continue
        rates = context.bauds_of(link.robot)
        if link.baud not in rates:
            near = near_bauds(link.baud, rates or BAUDS)
            supported_rates = f"its type has {' or '.join(map(str, rates))} baud" if rates else ""
            loc = ("links", index, "baud")
            yield Diagnostic(
                "LINE004",
                f"{link.baud} is not a standard baud rate",
                context.span(*loc),
                label=f"the link of `{link.robot}`",
                help=tuple(filter(None, (meant_baud(near), "" if near else supported_rates))),
                fix=make_fix(
                    f"write {near[0]}", replace_value(context.source, loc, near[0]), safe=bool(rates)
                )
                if len(near) == 1
                else None,
            )


def near_bauds(baud: int, known: Sequence[int] = BAUDS) -> list[int]:
    """Returns the baud rates of ``known`` from which ``baud`` differs by one typing error."""
    return [one for one in known if typing_errors(str(baud), str(one)) == 1]


def meant_baud(near: Sequence[int]) -> str:
    """Returns the help with the rates that may be meant; the empty text without any."""
    return f"did you mean {' or '.join(map(str, near))}?" if near else ""


@rule("LINE005")
def unknown_rates(context: RuleContext) -> Iterator[Diagnostic]:
    """A rate for a sensor that the robot type, or no type, has."""
    rates = context.spec.defaults.robot.rates
    kinds = context.native_types.values() if rates else ()
    everything = {sensor: None for one in kinds for sensor in one.sensors}
    for sensor in rates:
        if sensor not in everything and sensor != DIAGNOSTICS:
            yield _no_such_sensor(context, ("defaults", "robot"), sensor, "no robot type has a", everything)
    for name, robot in context.spec.robots.items():
        for sensor in robot.settings.rates:
            kind = context.native_robots.get(name)
            if kind is not None and sensor not in kind.sensors and sensor != DIAGNOSTICS:
                who = f"robot `{name}` (type `{robot.type}`) has no"
                yield _no_such_sensor(context, ("robots", name, "settings"), sensor, who, kind.sensors)


def _no_such_sensor(
    context: RuleContext, place: tuple[str, ...], sensor: str, who: str, sensors: Collection[str]
) -> Diagnostic:
    known = (*sensors, DIAGNOSTICS)
    loc, meant = (*place, "rates", sensor), guess(sensor, known)
    near = meant.only
    others = sorted(name for name, one in context.native_types.items() if sensor in one.sensors)
    return Diagnostic(
        "LINE005",
        f"{who} sensor `{sensor}`",
        context.span(*loc, key=True),
        label="unknown sensor",
        help=(
            *((f"types with a `{sensor}`: {', '.join(f'`{one}`' for one in others)}",) if others else ()),
            *did_you_mean(sensor, known, "the sensors are"),
        ),
        fix=make_fix(f"rename it to `{near}`", rename_key(context.source, loc, near), safe=meant.certain)
        if near
        else None,
    )


@rule("LINE008")
def refusals(context: RuleContext) -> Iterator[Diagnostic]:
    """A line that refuses a request begins as a good reply of the same protocol."""
    for name, kind in context.document.own_native_types.items():
        protocol = kind.protocol
        if not isinstance(protocol, LineProtocol):
            continue
        requests = (protocol.set_speed, *protocol.queries.values(), *protocol.setup)
        replies = [one.reply for one in (*requests, *((protocol.identify,) if protocol.identify else ()))]
        for index, refusal in enumerate(protocol.error_heads):
            good = next((one for one in replies if one and one.startswith(refusal)), None)
            if good is not None:
                yield Diagnostic(
                    "LINE008",
                    f"in type `{name}` the good reply `{good}` is taken for a refusal when it comes late",
                    context.document.span_of_type(name, "protocol", "error_heads", index),
                    label="begins a good reply, too",
                    help=("write what only a refusal begins with, or remove it",),
                )
