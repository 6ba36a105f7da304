"""Every budget of one document, gathered: lines, radios, boards, hosts and networks."""

from __future__ import annotations

from dataclasses import dataclass

from swarmctl.spec.load import Document
from swarmctl.topology import modes
from swarmctl.topology.boards import BoardBudget, board_budgets
from swarmctl.topology.bridges import bridges_of
from swarmctl.topology.capacity import HostBudget, NetworkBudget, host_budgets, network_budgets
from swarmctl.topology.interfaces import program_endpoints
from swarmctl.topology.lines import LineBudget, line_budgets
from swarmctl.topology.radios import RadioBudget, radio_budgets


@dataclass(frozen=True)
class Budgets:
    """What links, boards and hosts have to bear, each beside what it can; in the order of the spec."""

    lines: tuple[LineBudget, ...]
    radios: tuple[RadioBudget, ...]
    boards: tuple[BoardBudget, ...]
    hosts: tuple[HostBudget, ...]
    networks: tuple[NetworkBudget, ...]

    def to_json(self) -> dict[str, object]:
        return {
            "lines": [one.to_json() for one in self.lines],
            "radios": [one.to_json() for one in self.radios],
            "boards": [one.to_json() for one in self.boards],
            "hosts": [one.to_json() for one in self.hosts],
            "networks": [one.to_json() for one in self.networks],
        }


def budgets_of(document: Document) -> Budgets:
    """The budgets of a document without errors."""
    spec, types = document.spec, document.types
    endpoints = tuple(program_endpoints(spec))
    islands = modes.islands_of(spec)
    bridges = bridges_of(spec, types, islands, endpoints)
    lines = dict(line_budgets(spec, types, endpoints))
    return Budgets(
        lines=tuple(lines.values()),
        radios=radio_budgets(spec, {index: one.load for index, one in lines.items()}),
        boards=tuple(board_budgets(spec, types)),
        hosts=tuple(host_budgets(spec, document.computers, islands, bridges)),
        networks=tuple(network_budgets(spec, types, endpoints, islands)),
    )
