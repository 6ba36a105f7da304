"""What follows from the hosts of a lab: its mode, from the masters that they use, and their networks."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from swarmctl.importing.draft import Draft, Value
from swarmctl.spec.model import Mode
from swarmctl.swarm.addresses import ip_of, usual_subnet
from swarmctl.swarm.modes import MULTIMASTER, ROLES


def arrange(draft: Draft) -> None:
    """Adds the mode, the networks and the adapters of hosts to a draft that has all else."""
    draft.first = draft.first or dict(_mode(draft))
    mode = Mode(draft.first["mode"].value)
    if mode not in MULTIMASTER and draft.multimaster:
        place = draft.multimaster["packages"].place
        draft.unread.append(f"{place}: fkie's multimaster has no use with one master")
        draft.multimaster.clear()
    if mode is Mode.COMBINED:
        why = "hosts with the same ROS_MASTER_URI are an island"
        draft.last = {"islands": Value(_islands(_by_master(draft)), guess=why), **draft.last}
    addresses = {name: host.fields["address"] for name, host in draft.hosts.items()}
    draft.networks += _networks(
        {name: "" if one.fill_in else str(one.value) for name, one in addresses.items()}
    )
    for line in draft.lines:
        if line.value["kind"] == "bluetooth" and not line.fill_in:
            adapter = Value(["hci0"], guess="its first Bluetooth adapter")
            draft.hosts[line.value["host"]].fields["bluetooth"] = adapter


def _by_master(draft: Draft) -> Mapping[str, Sequence[str]]:
    """The hosts that use each master, by the master's host."""
    groups: dict[str, list[str]] = {}
    for host in draft.hosts:
        if host in draft.masters:
            groups.setdefault(draft.masters[host].value, []).append(host)
    return groups


def _mode(draft: Draft) -> Mapping[str, Value]:
    groups, multimaster = _by_master(draft), bool(draft.multimaster)
    known = [draft.masters[host] for host in draft.hosts if host in draft.masters]
    wrong = next((one for one in known if one.needed), Value(""))
    if len(draft.hosts) == 1 and not multimaster:
        only = replace(wrong, value=next(iter(draft.hosts)), guess="it is the only host")
        return {"mode": Value(Mode.SINGLE_MINDED.value, guess="there is one host"), "leader": only}
    if len(groups) == 1 and (len(known) > 1 or known[0].value not in next(iter(groups.values()))):
        return _one_master(draft, wrong if wrong.needed else known[0])
    first = wrong if wrong.needed or not known else replace(known[0], fill_in="")
    if len(known) == len(draft.hosts) and any(len(one) > 1 for one in groups.values()):
        why = f"there are {len(groups)} masters, and some hosts share one"
        return {"mode": replace(first, value=Mode.COMBINED.value, guess=why)}
    if groups and multimaster:
        why = "each host has its own master, and fkie's multimaster joins them"
    elif groups:
        why = "the hosts with a ROS_MASTER_URI do not share a master"
    elif multimaster:
        why = "nodes of fkie's multimaster join several masters"
    else:
        why = "no ROS_MASTER_URI was found, and without one ROS looks for the master on each node's own host"
    return {"mode": replace(first, value=Mode.STANDALONE.value, guess=why)}


def _one_master(draft: Draft, hub: Value) -> Mapping[str, Value]:
    programs = [one.fields for one in draft.programs.values() if not one.name.fill_in]
    hosts = [one["host"] for one in programs if "host" in one]
    busy = {one.value for one in hosts if not one.fill_in}
    why = hub.guess or f"ROS_MASTER_URI names `{hub.value}`"
    mode, because = Mode.CENTRAL, f"{why}; `leader` if only this host commands robots"
    if busy == {hub.value}:
        mode, because = Mode.LEADER, f"{why}, and programs run there only"
    elif busy:
        because = f"{why}, and programs run on other hosts too"
    return {"mode": Value(mode.value, hub.place, because), ROLES[mode].key: hub}


def _islands(groups: Mapping[str, Sequence[str]]) -> Mapping[str, object]:
    return {
        hub: {"mode": Mode.CENTRAL.value, "hub": hub, "hosts": list(dict.fromkeys([hub, *members]))}
        for hub, members in groups.items()
    }


def _networks(addresses: Mapping[str, str]) -> Iterator[Value]:
    """A network for the hosts of each /24; a host whose address is a name joins the largest."""
    subnets = {host: _subnet(address) for host, address in addresses.items()}
    sizes = Counter(one for one in subnets.values() if one)
    largest = sizes.most_common(1)[0][0] if sizes else ""
    groups: dict[str, list[str]] = {}
    for host, subnet in subnets.items():
        groups.setdefault(subnet or largest, []).append(host)
    shared = {subnet: members for subnet, members in groups.items() if len(members) > 1}
    for count, (subnet, members) in enumerate(shared.items(), 1):
        value = {"kind": "wlan", "name": "lab" if count == 1 else f"lab-{count}", "hosts": members}
        whose = (
            "their addresses are"
            if all(subnets[one] for one in members)
            else "those addresses that are not names are"
        )
        why = f"{whose} in {subnet}" if subnet else "nothing names their network"
        yield Value(value, guess=f"{why}; `wlan` or `ethernet`")
    if not shared and len(addresses) > 1:
        value = {"kind": "wlan", "name": "lab", "hosts": list(addresses)}
        yield Value(value, fill_in="the addresses share no network; write which hosts reach each other")


def _subnet(address: str) -> str:
    ip = ip_of(address)
    return str(usual_subnet(ip)) if ip else ""
