"""Both ends of a serial line speak at one rate, and the host's port can keep it."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.checks.case import Case, Rule
from swarmctl.checks.lines import BAUDS
from swarmctl.spec import edits
from swarmctl.spec.diagnostics import Diagnostic, Note, Severity
from swarmctl.spec.model import Serial

_BOARD_PORTS = ("/dev/ttyS0", "/dev/ttyAMA0", "/dev/serial0")
_BOARD_LIMIT = 460800  # rosserial#552: 921600 fails on the UART of a Raspberry Pi 3


def agreed_rates(case: Case) -> Iterator[Diagnostic]:
    """DEV007: a rate at which robots of this type do not speak. Of rates that nobody uses LINE004 tells."""
    for index, link in case.lines:
        if not isinstance(link, Serial) or link.baud is None or link.baud not in BAUDS:
            continue
        type_name = case.spec.robots[link.robot].type
        known = case.types[type_name].link
        if link.baud != known.baud and link.baud not in known.other_bauds:
            rates = " or ".join(str(rate) for rate in (known.baud, *known.other_bauds))
            yield Diagnostic(
                "DEV007",
                f"robot `{link.robot}` is a {type_name}, which speaks at {rates} baud, not at {link.baud}",
                case.span("links", index, "baud"),
                severity=Severity.WARNING,
                label="both ends need one rate",
                notes=(Note(case.span("robots", link.robot, "type"), "the robot's type"),),
                help=(f"leave `baud` out: the type's own, {known.baud}, then holds",),
                fix=edits.mend(
                    "leave `baud` to the type", edits.remove(case.document.source, ("links", index, "baud"))
                ),
            )


def board_ports(case: Case) -> Iterator[Diagnostic]:
    """DEV008: a rate that the UART of a Raspberry Pi loses bytes at."""
    for index, link in case.lines:
        if not isinstance(link, Serial) or link.device not in _BOARD_PORTS:
            continue
        baud = link.baud or case.types[case.spec.robots[link.robot].type].link.baud
        computer = case.computer_of(link.host) or ""
        if baud > _BOARD_LIMIT and computer.startswith("raspberry-pi"):
            yield Diagnostic(
                "DEV008",
                f"`{link.device}` of a {computer} loses bytes at {baud} baud",
                case.span("links", index, "baud" if link.baud else "device"),
                severity=Severity.WARNING,
                label=f"keeps up to {_BOARD_LIMIT}",
                notes=(Note(case.span("hosts", link.host, key=True), "this computer"),),
                help=("use a USB adapter, or a lower rate at both ends",),
            )


RULES: tuple[Rule, ...] = (agreed_rates, board_ports)
