"""Which mode a lab works in, from the masters that its hosts use, and which network its hosts share."""

from __future__ import annotations

import ipaddress
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

from swarmctl.importing.draft import Blank, Entry, Fact, Field
from swarmctl.spec.model import Mode

FKIE: Mapping[str, str] = {  # packages of nodes, and what `multimaster.packages` calls them
    "fkie_master_discovery": "fkie_multimaster",
    "fkie_master_sync": "fkie_multimaster",
    "master_discovery_fkie": "multimaster_fkie",
    "master_sync_fkie": "multimaster_fkie",
    "fkie_mas_discovery": "fkie_mas",
    "fkie_mas_sync": "fkie_mas",
}


@dataclass(frozen=True)
class Arrangement:
    """The keys of a spec that follow from its masters: above its hosts, and below its programs."""

    first: Mapping[str, Field]
    last: Mapping[str, Field] = field(default_factory=dict)


def arrangement(
    hosts: Sequence[str],
    masters: Mapping[str, Fact],
    busy: Collection[str],
    multimaster: Fact | None = None,
) -> Arrangement:
    """Returns the mode of ``hosts``; ``masters`` has the host of each one's master where it is known.

    ``busy`` are the hosts of programs; ``multimaster`` is fkie's package, if a node of it was found.
    """
    known = {host: masters[host] for host in hosts if host in masters and masters[host].value in hosts}
    groups: dict[str, list[str]] = {}
    for host, master in known.items():
        groups.setdefault(str(master.value), []).append(host)
    if len(hosts) == 1 and multimaster is None:
        only = {"mode": Fact(Mode.SINGLE_MINDED.value, None, "there is one host")}
        return Arrangement({**only, "leader": Fact(hosts[0], None, "it is the only host")})
    if len(groups) == 1 and next(iter(groups.items())) != (hub := next(iter(groups)), [hub]):
        return _one_master(hub, busy, next(iter(known.values())))
    place = next((one.place for one in known.values()), None)
    last: dict[str, Field] = {"multimaster": multimaster} if multimaster else {}
    if len(known) == len(hosts) and any(len(one) > 1 for one in groups.values()):
        mode = Fact(Mode.COMBINED.value, place, f"there are {len(groups)} masters, and some hosts share one")
        return Arrangement({"mode": mode}, {"islands": _islands(groups), **last})
    if groups:
        why = "the hosts with a ROS_MASTER_URI do not share a master"
    elif multimaster:
        why = "nodes of fkie's multimaster join several masters"
    else:
        why = "no ROS_MASTER_URI was found, and without one ROS looks for the master on each node's own host"
    return Arrangement({"mode": Fact(Mode.STANDALONE.value, place, why)}, last)


def _islands(groups: Mapping[str, Sequence[str]]) -> Fact:
    islands = {
        hub: {"mode": Mode.CENTRAL.value, "hub": hub, "hosts": list(dict.fromkeys([hub, *members]))}
        for hub, members in groups.items()
    }
    return Fact(islands, None, "hosts with the same ROS_MASTER_URI are an island")


def _one_master(hub: str, busy: Collection[str], shared: Fact) -> Arrangement:
    why = shared.guess or f"ROS_MASTER_URI names `{hub}`"
    if busy and set(busy) <= {hub}:
        mode, key, because = Mode.LEADER, "leader", f"{why}, and programs run there only"
    elif busy:
        mode, key, because = Mode.CENTRAL, "hub", f"{why}, and programs run on other hosts too"
    else:
        mode, key, because = Mode.CENTRAL, "hub", f"{why}; `leader` if only this host commands robots"
    hub_fact = Fact(hub, shared.place, shared.guess)
    return Arrangement({"mode": Fact(mode.value, shared.place, because), key: hub_fact})


def networks(hosts: Sequence[Entry]) -> tuple[Field, ...]:
    """Returns a network for the hosts of each /24; a host whose address is a name joins the largest."""
    subnets = {host.key: _subnet(host.value("address")) for host in hosts}
    sizes = Counter(one for one in subnets.values() if one)
    largest = sizes.most_common(1)[0][0] if sizes else ""
    groups: dict[str, list[str]] = {}
    for host, subnet in subnets.items():
        groups.setdefault(subnet or largest, []).append(host)
    shared = [(subnet, members) for subnet, members in groups.items() if len(members) > 1]
    if not shared and len(hosts) > 1:
        example = {"kind": "wlan", "name": "lab", "hosts": list(subnets)}
        return (Blank(example, "the addresses share no network; write which hosts reach each other"),)
    return tuple(
        _network(number, subnet, members, all(subnets[one] for one in members))
        for number, (subnet, members) in enumerate(shared, 1)
    )


def _network(number: int, subnet: str, members: Sequence[str], are_numbers: bool) -> Fact:
    name = "lab" if number == 1 else f"lab-{number}"
    whose = "their addresses are" if are_numbers else "those addresses that are not names are"
    why = f"{whose} in {subnet}" if subnet else "nothing names their network"
    value = {"kind": "wlan", "name": name, "hosts": list(members)}
    return Fact(value, None, f"{why}; `wlan` or `ethernet`")


def _subnet(address: object) -> str:
    try:
        return str(ipaddress.IPv4Network(f"{address}/24", strict=False))
    except ValueError:
        return ""
