"""Serial ports on the board of a Raspberry Pi: what they are wired to, and how fast they are."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic, Note
from swarmctl.links.serial_link import Serial
from swarmctl.rules.context import RuleContext, rule

_BOARD_PORTS = ("/dev/ttyS0", "/dev/ttyAMA0", "/dev/serial0")
_BOARD_LIMIT = 460800  # rosserial#552: 921600 fails on the UART of a Raspberry Pi 3
# Their firmware connects ttyAMA0 with the Bluetooth chip; a Raspberry Pi 2 has none, a 5 another UART for it.
_BLUETOOTH_ON_PL011 = ("raspberry-pi-3", "raspberry-pi-4", "raspberry-pi-zero-2w", "raspberry-pi-zero-w")


@rule("DEV008")
def board_ports(context: RuleContext) -> Iterator[Diagnostic]:
    """A baud rate at which the UART of a Raspberry Pi loses bytes."""
    for index, link in context.lines:
        if not isinstance(link, Serial) or link.device not in _BOARD_PORTS:
            continue
        baud = context.baud_of(link) or 0
        computer = context.computer_of(link.host) or ""
        if baud > _BOARD_LIMIT and computer.startswith("raspberry-pi"):
            yield Diagnostic(
                "DEV008",
                f"`{link.device}` of a {computer} loses bytes at {baud} baud",
                context.span("links", index, "baud" if link.baud else "device"),
                label=f"reliable up to {_BOARD_LIMIT}",
                notes=(Note(context.span("hosts", link.host, key=True), "this computer"),),
                help=("use a USB adapter, or a lower baud rate on both sides",),
            )


@rule("DEV009")
def ports_of_bluetooth(context: RuleContext) -> Iterator[Diagnostic]:
    """A robot on the UART that serves the Bluetooth of a Raspberry Pi."""
    for index, link in context.lines:
        if (
            not isinstance(link, Serial)
            or link.device != "/dev/ttyAMA0"
            or link.host not in context.spec.hosts
        ):
            continue
        computer, host = context.computer_of(link.host) or "", context.spec.hosts[link.host]
        if host.bluetooth and computer.startswith(_BLUETOOTH_ON_PL011):
            yield Diagnostic(
                "DEV009",
                f"`/dev/ttyAMA0` of a {computer} is the port of its Bluetooth, which host `{link.host}` uses",
                context.span("links", index, "device"),
                label="not wired to the pins",
                notes=(Note(context.span("hosts", link.host, "bluetooth"), "its Bluetooth adapters"),),
                help=(
                    "write `/dev/serial0`, with enable_uart=1 in config.txt, or use a USB adapter",
                    "suppress this if config.txt has dtoverlay=miniuart-bt, or if Bluetooth is a USB dongle",
                ),
            )
