"""Which robots each Bluetooth adapter serves, and how much of its air time they take. Pure numbers.

Bluetooth Core Specification, volume 2 part B: a piconet has seven active members beside its master; time
goes in slots of 625 us; a packet takes 1, 3 or 5 of them for up to 27, 183 or 339 bytes, and is answered.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from swarmctl.spec.model import Bluetooth, Spec
from swarmctl.topology.lines import Load

MOST = 7  # active members of a piconet
STABLE = 4  # robots that people report to stay connected (mmwise/sphero_ros#13)
SLOTS = 1600  # a second
_PACKETS = ((27, 1), (183, 3), (339, 5))  # bytes and slots, basic rate
_FRAMING = 9  # bytes of L2CAP and RFCOMM around each packet


@dataclass(frozen=True)
class RadioBudget:
    """One adapter of a host: its robots in the order of their links, and the slots a second they take."""

    host: str
    adapter: str
    members: tuple[str, ...]
    links: tuple[int, ...]  # index of each member's link
    slots: float

    @property
    def share(self) -> float:
        return self.slots / SLOTS

    def to_json(self) -> dict[str, object]:
        return {
            "host": self.host,
            "adapter": self.adapter,
            "members": list(self.members),
            "most": MOST,
            "stable": STABLE,
            "air_share": round(self.share, 3),
        }


def radio_budgets(spec: Spec, loads: Mapping[int, Load]) -> tuple[RadioBudget, ...]:
    """Every adapter that serves a robot, in the order of the spec. ``loads`` by index of the link."""
    served: dict[tuple[str, str], dict[int, str]] = {}
    for index, link in enumerate(spec.links):
        if isinstance(link, Bluetooth):
            have = spec.hosts[link.host].bluetooth
            adapter = link.adapter or next(iter(have), None)
            if adapter is not None:
                served.setdefault((link.host, adapter), {})[index] = link.robot
    return tuple(
        RadioBudget(
            host,
            adapter,
            tuple(robots.values()),
            tuple(robots),
            sum(slots_of(loads[index]) for index in robots if index in loads),
        )
        for (host, adapter), robots in served.items()
    )


def slots_of(load: Load) -> float:
    """Slots a second for the exchanges of one robot: request, reply, and the answer to each of them."""
    return sum(one.rate * (_slots(one.request) + _slots(one.reply) + 2) for one in load.exchanges)


def spread(budgets: Iterable[RadioBudget], adapters: Sequence[str], most: int) -> dict[str, str] | None:
    """Which robots of one host to move to which adapter so that none serves more than ``most``; else nothing.

    No assignment moves fewer: what an adapter has above ``most`` must leave it, and nothing else does.
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
