"""Every robot has one link to its host, of a kind that both support, with identities filled in."""

from __future__ import annotations

import re
from collections.abc import Iterator

from swarmctl.analysis.network_load import ip_link_budgets
from swarmctl.diagnostics import Diagnostic, Fix, Note
from swarmctl.links.bluetooth_link import Bluetooth
from swarmctl.links.serial_link import Serial
from swarmctl.linter.context import RuleContext, rule
from swarmctl.plugins import LINK_KINDS
from swarmctl.rules.modes import wrong_word
from swarmctl.spec.model import Mode
from swarmctl.swarm.addresses import normal
from swarmctl.yamltext.edits import append_item, make_fix, set_key


@rule("LINK001", "LINK002", "LINK003")
def robot_lines(context: RuleContext) -> Iterator[Diagnostic]:
    """A robot with no link, with several, or with a link to another host."""
    spec, meant = context.spec, None
    if spec.mode is Mode.SINGLE_MINDED and spec.leader is not None:
        meant = wrong_word(context, (), spec.leader, spec.hosts)
    for name, found in context.lines_of.items():
        host = context.driving[name]
        if not found and name not in context.driven_robots and not context.link_kinds(name):
            continue
        if not found:
            yield Diagnostic(
                "LINK001",
                f"robot `{name}` has no link to its host",
                context.span("robots", name, key=True),
                label=f"no {' or '.join(context.link_kinds(name))} link names it",
                help=tuple(f"add to `links`: {line}" for line in _possible_lines(context, name, host)),
            )
            continue
        first, link = found[0]
        for second, _ in found[1:]:
            yield Diagnostic(
                "LINK002",
                f"robot `{name}` has more than one link",
                context.span("links", second, "robot"),
                label="second link",
                notes=(Note(context.span("links", first, "robot"), "first link"),),
                help=("keep the one that its driver has to use",),
            )
        if host is not None and link.host != host:
            why = (
                "its driver runs on the leader"
                if spec.mode is Mode.SINGLE_MINDED
                else f"its driver runs on `{host}`"
            )
            place = ("leader",) if spec.mode is Mode.SINGLE_MINDED else ("robots", name, "host")
            yield Diagnostic(
                "LINK003",
                f"the link of robot `{name}` starts at `{link.host}`, but {why}",
                context.span("links", first, "host"),
                label="another host",
                notes=(Note(context.span(*place), f"`{host}` runs the driver"),),
                help=(f"set the link's `host: {host}`, or run the driver on `{link.host}`",),
                fix=meant,
            )


def _possible_lines(context: RuleContext, robot: str, host: str | None) -> Iterator[str]:
    """Yields the links, as spec text, that the robot type and its host support."""
    found = [kind for kind in LINK_KINDS if kind in context.link_kinds(robot)]
    for kind in sorted(found, key=lambda one: not LINK_KINDS.get(one).adapters_key):
        model = LINK_KINDS.get(kind)
        if not model.adapters_key or (host and getattr(context.spec.hosts[host], model.adapters_key)):
            yield f"{{kind: {kind}, host: {host or '...'}, robot: {robot}, {model.example}}}"


@rule("LINK007")
def link_kinds(context: RuleContext) -> Iterator[Diagnostic]:
    """A link of a kind that the robot type does not support."""
    robots = context.spec.robots
    of_type = {robot.type: name for name, robot in robots.items()}
    kinds_of = {type_name: context.link_kinds(robot) for type_name, robot in of_type.items()}
    for index, link in context.lines:
        type_name = robots[link.robot].type
        kinds = kinds_of[type_name]
        if link.kind not in kinds:
            yield Diagnostic(
                "LINK007",
                f"robot `{link.robot}` (type `{type_name}`) has no {link.kind} link",
                context.span("links", index, "kind"),
                label=f"not supported by `{type_name}`",
                notes=(Note(context.span("robots", link.robot, "type"), "the robot's type"),),
                help=(f"connect it by {' or '.join(kinds)}" if kinds else "remove the link: it needs none",),
            )


@rule("LINK006")
def adapters(context: RuleContext) -> Iterator[Diagnostic]:
    """A Bluetooth link on a host without that adapter."""
    spec = context.spec
    for index, link in enumerate(spec.links):
        if not isinstance(link, Bluetooth) or link.host not in spec.hosts:
            continue
        have = spec.hosts[link.host].bluetooth
        if not have or (link.adapter is not None and link.adapter not in have):
            missing = f"no adapter `{link.adapter}`" if link.adapter and have else "no Bluetooth adapter"
            yield Diagnostic(
                "LINK006",
                f"host `{link.host}` has {missing}",
                context.span("links", index, "adapter" if link.adapter else "host"),
                notes=(Note(context.span("hosts", link.host, key=True), "this host"),),
                help=(f"add `bluetooth: [{link.adapter or 'hci0'}]` to host `{link.host}` if it has one",),
                fix=_adapter_added(context, link.host, link.adapter or "hci0"),
            )


def _adapter_added(context: RuleContext, host: str, adapter: str) -> Fix | None:
    loc = ("hosts", host)
    if context.spec.hosts[host].bluetooth:
        edits = append_item(context.source, (*loc, "bluetooth"), adapter)
    else:
        edits = set_key(context.source, loc, "bluetooth", [adapter])
    return make_fix(f"add `{adapter}` to the adapters of `{host}`", edits, safe=False)


@rule("LINK008")
def channels(context: RuleContext) -> Iterator[Diagnostic]:
    """An RFCOMM channel that is not the robot type's."""
    for index, link, kind in context.native_lines:
        if not isinstance(link, Bluetooth) or link.channel is None:
            continue
        type_name = context.spec.robots[link.robot].type
        known = kind.link.rfcomm_channel
        if link.channel != known:
            others = [
                name
                for name, one in context.native_types.items()
                if "bluetooth" in one.link.kinds and one.link.rfcomm_channel == link.channel
            ]
            yield Diagnostic(
                "LINK008",
                f"robot `{link.robot}` (type `{type_name}`) has RFCOMM channel {known}, not {link.channel}",
                context.span("links", index, "channel"),
                label="another channel",
                notes=(Note(context.span("robots", link.robot, "type"), "the robot's type"),),
                help=(
                    f"leave `channel` out to use the type's, {known}",
                    *((f"or correct the type: `{others[0]}` has channel {link.channel}",) if others else ()),
                    "`sdptool browse MAC` shows the channels of a robot",
                ),
            )


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


_CAREFUL = 0.7  # share of a wireless link above which packets wait for each other


@rule("LINK012", "LINK015")
def full_links(context: RuleContext) -> Iterator[Diagnostic]:
    """A link that is to carry nearly its capacity, or more."""
    for budget in ip_link_budgets(context):
        if budget.share is None or budget.share <= _CAREFUL:
            continue
        yield Diagnostic(
            "LINK015" if budget.share > 1 else "LINK012",
            f"the link of robot `{budget.robot}` has to carry {budget.needed_mbps:.3g} of "
            f"{budget.capacity_mbps:g} Mbit/s",
            context.span("links", budget.link, "capacity_mbps"),
            label=f"{budget.share:.0%} of its capacity",
            notes=(Note(context.span("robots", budget.robot, key=True), f"robot `{budget.robot}`"),),
            help=(
                "let the driver publish less, or use a faster network",
                "`load_mbps` of the type's link has what the robot really sends, where it was measured",
            ),
        )


@rule("LINK014")
def addresses_of_hosts(context: RuleContext) -> Iterator[Diagnostic]:
    """A robot with the address of a host."""
    hosts = {normal(host.address): name for name, host in context.spec.hosts.items()}
    for index, ends in context.ip_links.items():
        host = hosts.get(normal(ends.link.address))
        if host is not None:
            yield Diagnostic(
                "LINK014",
                f"robot `{ends.link.robot}` has the address of host `{host}`",
                context.span("links", index, "address"),
                label="the packets to the robot arrive at the host",
                notes=(Note(context.span("hosts", host, "address"), f"host `{host}`"),),
                help=(
                    "write the address of the robot itself",
                    f"or ignore this, if `{host}` simulates the robot or passes its packets on",
                ),
            )
