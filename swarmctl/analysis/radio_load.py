"""Which Crazyflies each Crazyradio dongle serves, and the share of its time that they take. Pure numbers.

A Crazyradio polls: it sends one packet and receives the acknowledgement with up to one packet of the
Crazyflie in it (Bitcraze, Crazyradio functional specification). So each command and each message that a
Crazyflie sends costs an exchange. Its time on the air follows from the nRF24LU1+ product specification
(Enhanced ShockBurst, full packets). USB is estimated: one frame of 1 ms for the exchange, and one more for
the request that sets the next address if a dongle serves several.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from swarmctl.analysis.serial_load import command_rates
from swarmctl.links.radio_link import Radio
from swarmctl.swarm.index import SwarmIndex

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
