"""Faults of a host's network: cables, packets that are lost, bandwidth, multicast."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from swarmctl.lab.faults.fault_kind import FaultKind, FaultOption, RunningLab, scripted
from swarmctl.lab.hosts import network
from swarmctl.lab.hosts.processes import run

if TYPE_CHECKING:
    from swarmctl.lab.lab_plan import LabPlan
    from swarmctl.lab.paths import LabPaths

_BUCKET = ("burst", "8kb", "latency", "400ms")  # more than a packet of 1 500 B fits, and none waits for ever
# Neighbours of IPv6 are found by multicast: without them there is no network at all.
_NEIGHBOURS = "ip6 daddr { ff02::1, ff02::2, ff02::1:ff00:0/104 } accept"
_MULTICAST = ("ip daddr 224.0.0.0/4 drop", "ip6 daddr ff00::/8 drop")


def percent(text: str) -> float:
    """Reads a share of packets, in percent."""
    if not re.fullmatch(r"\d+(\.\d+)?", text) or not 0.1 <= float(text) <= 100:
        raise ValueError("write a number from 0.1 to 100, in percent")
    return float(text)


def rate(text: str) -> str:
    """Reads a bandwidth, such as 1Mbit or 1Mbit/s (per second in either case)."""
    if not re.fullmatch(r"(?=.*[1-9])\d+(\.\d+)?[kMG]bit(/s)?", text):
        raise ValueError("write a number with kbit, Mbit or Gbit, such as 1Mbit: it is per second")
    return text.removesuffix("/s")


def _rules(table: str, *rules: str, in_front: str = "") -> str:
    """A shell script that puts rules in place of ``table``, in both directions; without rules, of nothing."""
    lines = [f"table inet {table}", f"delete table inet {table}"]
    if rules:
        lines.append(f"table inet {table} {{")
        for hook, remote in (("input", 'iif != "lo"'), ("output", 'oif != "lo"')):
            lines += [f"  chain {hook} {{", f"    type filter hook {hook} priority -300", f"    {in_front}"]
            lines += [f"    {remote} {rule}" for rule in rules]
            lines.append("  }")
        lines.append("}")
    return "nft -f - <<'END'\n" + "\n".join(filter(str.strip, lines)) + "\nEND"


def loss_script(share: float) -> str:
    """Returns the script that loses ``share`` percent of the packets from and to a host."""
    return _rules("lab_loss", f"numgen random mod 100000 <= {round(1000 * share) - 1} drop")


def no_multicast_script() -> str:
    """Returns the script that loses the multicast packets from and to a host."""
    return _rules("lab_multicast", *_MULTICAST, in_front=_NEIGHBOURS)


def rate_argvs(plan: LabPlan, files: LabPaths, host: str, limit: str | None) -> Iterator[tuple[str, ...]]:
    """Yields the ``tc`` commands for both ends of a host's cables: ``limit`` bit/s, or no limit for None."""
    shape = ("noqueue",) if limit is None else ("tbf", "rate", limit, *_BUCKET)
    for interface in plan.host(host).interfaces:
        ends = (
            (files.namespace(), network.port(plan, host, interface.network)),
            (files.namespace(host), interface.name),
        )
        for namespace, device in ends:
            yield ("tc", "-n", namespace, "qdisc", "replace", "dev", device, "root", *shape)


def _link_down(lab: RunningLab, host: str, name: str | None) -> str:
    off = network.set_cable(lab.plan, lab.files, host, up=False, network=name)
    return f"disconnected from {', '.join(off)}"


def _link_up(lab: RunningLab, hosts: Sequence[str]) -> None:
    for host in hosts:
        network.set_cable(lab.plan, lab.files, host, up=True)


def _limit(lab: RunningLab, host: str, limit: str) -> str:
    _set_rate(lab, host, limit)
    return f"its networks carry {limit}/s"


def _unlimited(lab: RunningLab, hosts: Sequence[str]) -> None:
    for host in hosts:
        _set_rate(lab, host, None)


def _set_rate(lab: RunningLab, host: str, limit: str | None) -> None:
    for argv in rate_argvs(lab.plan, lab.files, host, limit):
        run(argv)


LINK_DOWN = FaultKind(
    "link-down",
    "Disconnect hosts from their networks.",
    _link_down,
    _link_up,
    option=FaultOption(
        "network",
        "NAME",
        "Only this network; by default all networks of the host.",
        needed=False,
    ),
)
LOSS = scripted(
    "loss",
    "Lose packets from and to hosts, at random.",
    loss_script,
    _rules("lab_loss"),
    outcome=lambda share: f"loses {share:g} % of the packets in each direction",
    option=FaultOption("percent", "N", "How many packets are lost, in percent.", percent),
)
BANDWIDTH = FaultKind(
    "bandwidth",
    "Limit the bandwidth of each cable of hosts, in both directions.",
    _limit,
    _unlimited,
    option=FaultOption("rate", "RATE", "Bits per second, such as 1Mbit or 500kbit.", rate),
)
NO_MULTICAST = scripted(
    "no-multicast",
    "Lose the multicast packets from and to hosts.",
    lambda _: no_multicast_script(),
    _rules("lab_multicast"),
    outcome=lambda _: "no multicast",
)
