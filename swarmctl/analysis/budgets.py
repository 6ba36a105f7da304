"""All budgets of one swarm: links of robots, radio adapters, boards, hosts and networks."""

from __future__ import annotations

from dataclasses import dataclass

from swarmctl.analysis.host_load import HostBudget, host_budgets
from swarmctl.analysis.network_load import IpLinkBudget, NetworkBudget, ip_link_budgets, network_budgets
from swarmctl.analysis.radio_load import BluetoothBudget, DongleBudget, bluetooth_budgets, dongle_budgets
from swarmctl.analysis.rosserial_load import RosserialBudget, rosserial_budgets
from swarmctl.analysis.serial_load import SerialBudget, serial_budgets
from swarmctl.swarm.bridges import bridges_of
from swarmctl.swarm.index import SwarmIndex


@dataclass(frozen=True)
class Budgets:
    """The load of links, boards and hosts, each beside its limit; in the order of the spec."""

    lines: tuple[SerialBudget, ...]
    radios: tuple[BluetoothBudget, ...]
    dongles: tuple[DongleBudget, ...]
    ip_links: tuple[IpLinkBudget, ...]
    boards: tuple[RosserialBudget, ...]
    hosts: tuple[HostBudget, ...]
    networks: tuple[NetworkBudget, ...]

    def to_json(self) -> dict[str, object]:
        """Returns the value as JSON data, as docs/graph.md describes it."""
        return {kind: [one.to_json() for one in found] for kind, found in vars(self).items()}


def budgets_of(index: SwarmIndex) -> Budgets:
    """Returns the budgets of a document without errors."""
    lines = dict(serial_budgets(index))
    return Budgets(
        lines=tuple(lines.values()),
        radios=bluetooth_budgets(index, {number: one.load for number, one in lines.items()}),
        dongles=tuple(dongle_budgets(index)),
        ip_links=tuple(ip_link_budgets(index)),
        boards=tuple(rosserial_budgets(index)),
        hosts=tuple(host_budgets(index, bridges_of(index))),
        networks=tuple(network_budgets(index)),
    )
