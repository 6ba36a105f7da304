"""Serial numbers and Bluetooth addresses that `init` or a template wrote, and that nobody has filled in."""

from __future__ import annotations

import re
from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic
from swarmctl.links.bluetooth_link import Bluetooth
from swarmctl.links.serial_link import Serial
from swarmctl.rules.context import RuleContext, rule

SERIAL = "SERIAL-OF-"  # what `init` writes before the robot's name
MAC = "02:00:00:00:"  # of what `init` writes; no device has a locally administered one (IEEE 802)
_SERIAL = re.compile(rf"{SERIAL}.+|xxx+|to-?do|tbd|fixme|change-?me|placeholder", re.ASCII | re.IGNORECASE)
_MAC = re.compile(rf"{MAC}[0-9]{{2}}:[0-9]{{2}}", re.ASCII | re.IGNORECASE)
_MOST_NAMED = 6
_KINDS = {
    "serial": (
        "USB serial number",
        "s",
        "`udevadm info -a /dev/ttyUSB0 | grep -m1 serial` on the host shows that of an adapter",
    ),
    "bluetooth": (
        "Bluetooth address",
        "es",
        "`bluetoothctl scan on` on the host shows the addresses of robots that are switched on",
    ),
}


@rule("LINK013")
def placeholders(context: RuleContext) -> Iterator[Diagnostic]:
    """Placeholders of adapters and addresses: one finding for each kind of link."""
    found: dict[str, list[tuple[int, str]]] = {}
    for index, link in context.lines:
        if isinstance(link, Bluetooth) and _MAC.fullmatch(link.mac):
            found.setdefault("bluetooth", []).append((index, link.robot))
        elif isinstance(link, Serial) and link.usb and _SERIAL.fullmatch(link.usb.serial or ""):
            found.setdefault("serial", []).append((index, link.robot))
    for kind, links in found.items():
        what, plural, where = _KINDS[kind]
        many = len(links) > 1
        named = ", ".join(f"`{robot}`" for _, robot in links[:_MOST_NAMED])
        more = f" and {len(links) - _MOST_NAMED} more" if len(links) > _MOST_NAMED else ""
        yield Diagnostic(
            "LINK013",
            f"the {what}{plural} of {named}{more} are placeholders"
            if many
            else f"the {what} of {named} is a placeholder",
            context.span("links", links[0][0], *(("mac",) if kind == "bluetooth" else ("usb",))),
            label=f"its driver finds no {'robot' if kind == 'bluetooth' else 'adapter'} with it",
            help=(where,),
        )
