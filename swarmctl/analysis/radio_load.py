"""Bluetooth adapters and Crazyradio dongles: which robots each serves, and their share of its time.

Bluetooth Core Specification, volume 2 part B: a piconet has seven active members beside its master; a slot is
625 us long; a packet takes 1, 3 or 5 slots for up to 27, 183 or 339 bytes, and is acknowledged.

A Crazyradio polls: it sends one packet and receives the acknowledgement with up to one packet of the
Crazyflie in it (Bitcraze, Crazyradio functional specification). So each command and each message that a
Crazyflie sends costs an exchange. Its time on the air follows from the nRF24LU1+ product specification
(Enhanced ShockBurst, full packets). USB is estimated: one frame of 1 ms for the exchange, and one more for
the request that sets the next address if a dongle serves several.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from swarmctl.analysis.serial_load import SerialLoad, command_rates
from swarmctl.links.bluetooth_link import Bluetooth
from swarmctl.links.radio_link import Radio
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
    # Lines of one kind share a load: it is looked up by its identity, as its hash takes as long as the sum.
    slots = {id(load): slots_of(load) for load in {id(one): one for one in loads.values()}.values()}
    return tuple(
        BluetoothBudget(
            host,
            adapter,
            tuple(robots.values()),
            tuple(robots),
            sum(slots[id(loads[number])] for number in robots if number in loads),
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


_PACKET_BITS = 8 * (1 + 5 + 32 + 2) + 9  # preamble, address, payload, checksum, and the control field
_TURNS = 2 * 130e-6  # s from receiving to sending and back
_USB_FRAME = 1e-3  # s


@dataclass(frozen=True)
class DongleBudget:
    """One Crazyradio of a host, its robots in the order of their links, and the share of time they take."""

    host: str
    dongle: str
    members: tuple[str, ...]
    links: tuple[int, ...]  # index of each member's link
    exchanges: tuple[float, ...]  # a second, of each member
    share: float  # above 1 it is overloaded

    def to_json(self) -> dict[str, object]:
        """Returns the value as JSON data, as docs/graph.md describes it."""
        return {
            "host": self.host,
            "dongle": self.dongle,
            "members": list(self.members),
            "exchanges_per_second": round(sum(self.exchanges), 1),
            "share": round(self.share, 3),
        }


def dongle_links(index: SwarmIndex) -> Mapping[tuple[str, str], list[tuple[int, Radio]]]:
    """Returns the links that each Crazyradio serves, with their places, by its host and name."""
    found: dict[tuple[str, str], list[tuple[int, Radio]]] = {}
    for number, link in index.lines:
        if isinstance(link, Radio):
            found.setdefault((link.host, link.dongle), []).append((number, link))
    return found


def dongle_budgets(index: SwarmIndex) -> Iterator[DongleBudget]:
    """Yields the budget of every dongle that serves a robot, in the order of the spec."""
    dongles = dongle_links(index)
    rates = command_rates(index) if dongles else {}
    for (host, dongle), links in dongles.items():
        exchanges = [_exchanges(index, link.robot, rates[link.robot]) for _, link in links]
        yield DongleBudget(
            host,
            dongle,
            tuple(link.robot for _, link in links),
            tuple(number for number, _ in links),
            tuple(exchanges),
            _share([link.rate for _, link in links], exchanges),
        )


def seconds_of(rate: int, *, shared: bool) -> float:
    """Returns how long an exchange takes at ``rate`` bit/s; ``shared``: the dongle serves several robots."""
    return 2 * _PACKET_BITS / rate + _TURNS + _USB_FRAME * (2 if shared else 1)


def _share(rates: Sequence[int], exchanges: Sequence[float]) -> float:
    shared = len(rates) > 1
    return sum(many * seconds_of(rate, shared=shared) for rate, many in zip(rates, exchanges, strict=True))


def _exchanges(index: SwarmIndex, robot: str, commands: float) -> float:
    """The exchanges a second of a robot: its commands, and the messages that its driver publishes."""
    taken = commands if robot in index.command_topics else 0.0
    return taken + sum(one.rate for one in index.driver_topics(robot))
