"""No two things share what must be their own: address, device, Bluetooth address, ROS namespace."""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Iterator
from typing import Any

from swarmctl.checks.case import Case, Rule
from swarmctl.spec.diagnostics import Diagnostic, Fix, Note
from swarmctl.spec.edits import mend, replace_value
from swarmctl.spec.mentions import rename, renaming
from swarmctl.spec.model import Bluetooth, Serial, Usb
from swarmctl.topology import names
from swarmctl.topology.address import Subnet, normal
from swarmctl.topology.ports import ssh_port

_LOCALHOST = "localhost"

Place = tuple[Any, ...]
Claim = tuple[Hashable, str, Place]  # what is claimed, by whom, and where that stands


def doubled_addresses(case: Case) -> Iterator[Diagnostic]:
    """ID001: two hosts with one address; whoever answers first gets both configurations."""
    hosts = case.spec.hosts
    claims: list[Claim] = [
        ((normal(host.address), ssh_port(case.spec, name)), f"host `{name}`", ("hosts", name, "address"))
        for name, host in hosts.items()
    ]
    yield from _doubled(case, "ID001", "address", claims, "give each host its own address")


def doubled_devices(case: Case) -> Iterator[Diagnostic]:
    """ID002: two robots on one device, or one USB adapter serving two robots of one host."""
    claims: list[Claim] = []
    adapters: dict[tuple[str, str], list[Usb]] = {}
    for index, link in case.lines:
        if isinstance(link, Serial) and link.usb is not None:
            named = adapters.setdefault((link.host, link.usb.serial), [])
            same = (place for place, one in enumerate(named) if _may_be_one(one, link.usb))
            adapter = next(same, len(named))
            named[adapter:] = named[adapter:] or [link.usb]
            claims.append(
                (
                    (link.host, link.usb.serial, adapter),
                    f"robot `{link.robot}`",
                    ("links", index, "usb", "serial"),
                )
            )
        elif isinstance(link, Serial) and link.device is not None:
            claims.append(((link.host, link.device), f"robot `{link.robot}`", ("links", index, "device")))
    yield from _doubled(case, "ID002", "serial device", claims, "each robot needs a line of its own")


def _may_be_one(first: Usb, second: Usb) -> bool:
    """Whether udev could take one adapter for both; cheap ones differ in their ids only."""
    pairs = ((first.vendor, second.vendor), (first.product, second.product))
    return all(one is None or other is None or one == other for one, other in pairs)


def doubled_bluetooth(case: Case) -> Iterator[Diagnostic]:
    """ID003: two robots with one Bluetooth address."""
    claims: list[Claim] = [
        (link.mac, f"robot `{link.robot}`", ("links", index, "mac"))
        for index, link in enumerate(case.spec.links)
        if isinstance(link, Bluetooth)
    ]
    yield from _doubled(
        case,
        "ID003",
        "Bluetooth address",
        claims,
        "each robot has its own address; its label or `bluetoothctl scan on` shows it",
    )


def doubled_networks(case: Case) -> Iterator[Diagnostic]:
    """ID004: two networks with one name."""
    claims: list[Claim] = [
        (link.name, f"entry {index + 1} of `links`", ("links", index, "name"))
        for index, link in case.networks
    ]
    networks = dict(case.networks)
    taken = {link.name for link in networks.values()}

    def renamed(loc: Place) -> Fix | None:
        if any(_overlap(case.subnets[loc[1]], case.subnets[one]) for one in networks if one != loc[1]):
            return None  # they may be one network
        name = _free(networks[loc[1]].name, taken)
        taken.add(name)
        return mend(f"rename it to `{name}`", replace_value(case.source, loc, name))

    yield from _doubled(case, "ID004", "network name", claims, "rename one of them", fix=renamed)


def _overlap(one: Subnet | None, other: Subnet | None) -> bool:
    return one is not None and other is not None and one.version == other.version and one.overlaps(other)


def _free(name: str, taken: Collection[str]) -> str:
    """The name itself, or with the next number that makes it one of its own; 31 letters are the most."""
    tries = (name, *(f"{name[:27]}-{number}" for number in range(2, 1000)))
    return next((one for one in tries if one not in taken), name)


def _doubled(
    case: Case,
    code: str,
    what: str,
    claims: list[Claim],
    help_: str,
    *,
    fix: Callable[[Place], Fix | None] = lambda _: None,
) -> Iterator[Diagnostic]:
    first: dict[Hashable, tuple[str, Place]] = {}
    for claimed, owner, loc in claims:
        if claimed not in first:
            first[claimed] = (owner, loc)
            continue
        earlier, place = first[claimed]
        yield Diagnostic(
            code,
            f"{earlier} and {owner} have the same {what}",
            case.span(*loc),
            label=f"also used by {owner}",
            notes=(Note(case.span(*place), f"first used by {earlier}"),),
            help=(help_,),
            fix=fix(loc),
        )


def reserved_names(case: Case) -> Iterator[Diagnostic]:
    """ID006: taken names. Robots and programs are units beside the master's; hosts go into /etc/hosts."""
    if _LOCALHOST in case.spec.hosts:
        yield Diagnostic(
            "ID006",
            f"`{_LOCALHOST}` is what every host calls itself",
            case.span("hosts", _LOCALHOST, key=True),
            help=("choose another name; it goes into /etc/hosts",),
            fix=_renamed(case, "hosts", _LOCALHOST, f"{case.spec.name}-host"),
        )
    for kind in ("robots", "programs"):
        for part, what in names.TAKEN.items():
            if part in getattr(case.spec, kind):
                yield Diagnostic(
                    "ID006",
                    f"`{part}` is the name of {what}",
                    case.span(kind, part, key=True),
                    help=("choose another name",),
                    fix=_renamed(case, kind, part, f"{case.spec.name}-{part}"),
                )
    for name in case.spec.programs:
        if name in case.spec.robots:
            yield Diagnostic(
                "ID006",
                f"a robot and a program are both called `{name}`",
                case.span("programs", name, key=True),
                notes=(Note(case.span("robots", name, key=True), "the robot"),),
                help=("rename the program",),
                fix=_renamed(case, "programs", name, f"{name}-program"),
            )


def _renamed(case: Case, kind: str, old: str, new: str) -> Fix | None:
    """Another name, everywhere, that no host, robot or program has."""
    spec = case.spec
    name = _free(new[:31], {*spec.hosts, *spec.robots, *spec.programs})
    return renaming(old, name, rename(case.source, kind, old, name))


RULES: tuple[Rule, ...] = (
    doubled_addresses,
    doubled_devices,
    doubled_bluetooth,
    doubled_networks,
    reserved_names,
)
