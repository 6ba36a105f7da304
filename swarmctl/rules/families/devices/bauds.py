"""The baud rate of a serial link: supported by the robot type and by the host's port."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic, Note, Severity
from swarmctl.rules.context import RuleContext, rule
from swarmctl.rules.families.serial_lines.rules import BAUDS
from swarmctl.spec.model import Serial
from swarmctl.yamltext import edits

_BOARD_PORTS = ("/dev/ttyS0", "/dev/ttyAMA0", "/dev/serial0")
_BOARD_LIMIT = 460800  # rosserial#552: 921600 fails on the UART of a Raspberry Pi 3


@rule("DEV007")
def agreed_rates(context: RuleContext) -> Iterator[Diagnostic]:
    """A baud rate that the robot type does not support. LINE004 reports non-standard rates."""
    for index, link in context.lines:
        if not isinstance(link, Serial) or link.baud is None or link.baud not in BAUDS:
            continue
        type_name = context.spec.robots[link.robot].type
        known = context.types[type_name].link
        if link.baud != known.baud and link.baud not in known.other_bauds:
            rates = " or ".join(str(rate) for rate in (known.baud, *known.other_bauds))
            yield Diagnostic(
                "DEV007",
                f"robot `{link.robot}` (type `{type_name}`) supports {rates} baud, not {link.baud}",
                context.span("links", index, "baud"),
                severity=Severity.WARNING,
                label="both sides need the same rate",
                notes=(Note(context.span("robots", link.robot, "type"), "the robot's type"),),
                help=(f"leave `baud` out to use the type's rate, {known.baud}",),
                fix=edits.make_fix(
                    "remove `baud`",
                    edits.remove(context.document.source, ("links", index, "baud")),
                    safe=False,
                ),
            )


@rule("DEV008")
def board_ports(context: RuleContext) -> Iterator[Diagnostic]:
    """A baud rate at which the UART of a Raspberry Pi loses bytes."""
    for index, link in context.lines:
        if not isinstance(link, Serial) or link.device not in _BOARD_PORTS:
            continue
        baud = link.baud or context.types[context.spec.robots[link.robot].type].link.baud
        computer = context.computer_of(link.host) or ""
        if baud > _BOARD_LIMIT and computer.startswith("raspberry-pi"):
            yield Diagnostic(
                "DEV008",
                f"`{link.device}` of a {computer} loses bytes at {baud} baud",
                context.span("links", index, "baud" if link.baud else "device"),
                severity=Severity.WARNING,
                label=f"reliable up to {_BOARD_LIMIT}",
                notes=(Note(context.span("hosts", link.host, key=True), "this computer"),),
                help=("use a USB adapter, or a lower baud rate on both sides",),
            )
