"""Which robots each Bluetooth adapter serves, and the share of its air time that they take. Pure numbers.

Bluetooth Core Specification, volume 2 part B: a piconet has seven active members beside its master; a slot is
625 us long; a packet takes 1, 3 or 5 slots for up to 27, 183 or 339 bytes, and is acknowledged.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from swarmctl.analysis.serial_load import SerialLoad
from swarmctl.links.bluetooth_link import Bluetooth
from swarmctl.swarm.index import SwarmIndex

MOST = 7  # active members of a piconet
STABLE = 4  # robots that stay connected according to user reports (mmwise/sphero_ros#13)
SLOTS = 1600  # a second
_PACKETS = ((27, 1), (183, 3), (339, 5))  # bytes and slots, basic rate
_FRAMING = 9  # bytes of L2CAP and RFCOMM around each packet


@dataclass(frozen=True)
class BluetoothBudget:
    """One adapter of a host: its robots in the order of their links, and the slots a second they take."""

    host: str
    adapter: str
    members: tuple[str, ...]
    links: tuple[int, ...]  # index of each member's link
    slots: float

    @property
    def share(self) -> float:
        """The used share of the air time; above 1 it is overloaded."""
        return self.slots / SLOTS

    def to_json(self) -> dict[str, object]:
        """Returns the value as JSON data, as docs/graph.md describes it."""
        return {
            "host": self.host,
            "adapter": self.adapter,
            "members": list(self.members),
            "most": MOST,
            "stable": STABLE,
            "air_share": round(self.share, 3),
        }


def bluetooth_budgets(index: SwarmIndex, loads: Mapping[int, SerialLoad]) -> tuple[BluetoothBudget, ...]:
    """Returns the budget of every adapter that serves a robot, in the order of the spec.

    ``loads`` by link index.
    """
    served: dict[tuple[str, str], dict[int, str]] = {}
    for number, link in index.lines:
        if isinstance(link, Bluetooth) and (adapter := index.adapter_of(link)) is not None:
            served.setdefault((link.host, adapter), {})[number] = link.robot
    return tuple(
        BluetoothBudget(
            host,
            adapter,
            tuple(robots.values()),
            tuple(robots),
            sum(slots_of(loads[number]) for number in robots if number in loads),
        )
        for (host, adapter), robots in served.items()
    )


def slots_of(load: SerialLoad) -> float:
    """Slots a second for the exchanges of one robot: request, reply, and the acknowledgement of each."""
    return sum(one.rate * (_slots(one.request) + _slots(one.reply) + 2) for one in load.exchanges)


def spread(budgets: Iterable[BluetoothBudget], adapters: Sequence[str], most: int) -> dict[str, str] | None:
    """The new adapter of each robot to move so that no adapter of a host serves more than ``most``.

    None if the host has too few adapters. No assignment moves fewer robots.
    """
    served = dict.fromkeys(adapters, 0)
    leaving: list[str] = []
    for budget in budgets:
        stay = min(len(budget.members), most) if budget.adapter in served else 0
        served |= {budget.adapter: stay} if stay else {}
        leaving += budget.members[stay:]
    places = [adapter for adapter, count in served.items() for _ in range(most - count)]
    return dict(zip(leaving, places, strict=False)) if len(leaving) <= len(places) else None


def _slots(size: int) -> int:
    whole, rest = divmod(size + _FRAMING, _PACKETS[-1][0])
    last = next((slots for most, slots in _PACKETS if rest <= most), 0) if rest else 0
    return whole * _PACKETS[-1][1] + last
