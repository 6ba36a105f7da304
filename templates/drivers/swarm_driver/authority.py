"""Who may move the robot: the sender of each order, the robot's commanders, and time. Knows no ROS.

A commander holds the robot from its first order until it has been silent for ``command_timeout``; meanwhile
only a higher one is obeyed. A stop is an order like any other: it lasts until the next order of who holds the
robot, so stops let in from anybody would make a robot stutter and nobody safe.
"""

from __future__ import annotations

import ipaddress
from collections import OrderedDict
from dataclasses import dataclass
from typing import Sequence

NOBODY = "nobody"
_MOST_REFUSED = 16  # senders that are remembered
_REMEMBERED = 60.0  # s after its last order for which a refused sender is named
_RECENT = 5.0  # s for which a refusal is complained of: the longest time between two reports
_MOST_NAMED = 3  # senders in one text


@dataclass(frozen=True)
class Commander:
    """Nodes by name, all in a namespace, all on some hosts (by the address their nodes advertise)."""

    name: str
    priority: int
    nodes: tuple[str, ...] = ()
    namespace: str | None = None
    addresses: tuple[str, ...] = ()

    def includes(self, sender: Sender) -> bool:
        return (
            sender.node in self.nodes
            or sender.host in self.addresses
            or (self.namespace is not None and sender.node.startswith(self.namespace + "/"))
        )


@dataclass(frozen=True)
class Sender:
    """A node that sends orders, and the host in its URI: none while that is not known."""

    node: str
    host: str | None = None

    def __str__(self) -> str:
        return f"{self.node} on {self.host}" if self.host else self.node


@dataclass(frozen=True)
class Standing:
    """Who is obeyed now, who was refused lately, and what is wrong with that (nothing: empty)."""

    commander: str = NOBODY
    refused: str = "none"
    complaint: str = ""


@dataclass
class _Hold:
    """The sender that a priority belongs to until it has been silent for long enough.

    ``spoken`` is when anybody of this priority was heard: lower ones wait for all of them.
    """

    commander: str
    node: str
    heard: float
    spoken: float

    def __str__(self) -> str:
        return f"{self.commander} ({self.node})"


@dataclass
class _Refused:
    """A sender's refusals. ``behind``: who held the robot at the last one; empty for who is no commander."""

    sender: Sender
    count: int
    heard: float
    behind: str


class Authority:
    """Takes or refuses orders. Its memory is bounded by the commanders and ``_MOST_REFUSED``."""

    def __init__(self, commanders: Sequence[Commander], timeout: float) -> None:
        self._commanders = sorted(commanders, key=lambda one: -one.priority)
        self._timeout = timeout
        self._holds: dict[int, _Hold] = {}  # by priority
        self._refused: OrderedDict[str, _Refused] = OrderedDict()  # by node, the one heard last at the end

    def admits(self, sender: Sender, now: float) -> bool:
        """Whether an order that ``sender`` gives at ``now`` is to be obeyed."""
        commander = next((one for one in self._commanders if one.includes(sender)), None)
        if commander is None:
            return self._refuse(sender, now)
        hold = self._holds.get(commander.priority)
        if hold is not None and hold.node != sender.node and self._recent(hold.heard, now):
            hold.spoken = now
            return self._refuse(sender, now, behind=str(hold))
        self._holds[commander.priority] = own = _Hold(commander.name, sender.node, now, now)
        above = self._highest(now)
        if above is not None and above is not own:
            return self._refuse(sender, now, behind=str(above))
        self._refused.pop(sender.node, None)
        return True

    def standing(self, now: float) -> Standing:
        while self._refused and next(iter(self._refused.values())).heard < now - _REMEMBERED:
            self._refused.popitem(last=False)
        lately = list(reversed(self._refused.values()))
        strangers = [one for one in lately if not one.behind and one.heard >= now - _RECENT]
        hold = self._highest(now)
        return Standing(
            commander=str(hold) if hold is not None and self._recent(hold.heard, now) else NOBODY,
            refused=_listed([self._told(one) for one in lately], "; ") or "none",
            complaint=self._complaint([one.sender for one in strangers]) if strangers else "",
        )

    def _told(self, refused: _Refused) -> str:
        why = f"behind {refused.behind}" if refused.behind else self._strangeness(refused.sender)
        return f"{refused.sender} ({refused.count} order{'' if refused.count == 1 else 's'}): {why}"

    def _complaint(self, strangers: Sequence[Sender]) -> str:
        who = _listed([str(one) for one in strangers], ", ")
        return f"refuses {who}: {self._strangeness(strangers[0])}"

    def _recent(self, moment: float, now: float) -> bool:
        return now < moment + self._timeout

    def _highest(self, now: float) -> _Hold | None:
        """The highest priority of which anybody was heard."""
        holds = (self._holds[priority] for priority in sorted(self._holds, reverse=True))
        return next((hold for hold in holds if self._recent(hold.spoken, now)), None)

    def _refuse(self, sender: Sender, now: float, *, behind: str = "") -> bool:
        known = self._refused.pop(sender.node, None)
        count = known.count + 1 if known is not None else 1
        self._refused[sender.node] = _Refused(sender, count, now, behind)
        if len(self._refused) > _MOST_REFUSED:
            self._refused.popitem(last=False)
        return False

    def _strangeness(self, sender: Sender) -> str:
        """Why a sender is no commander."""
        if not self._commanders:
            return "nobody may command it"
        if sender.host is None:
            return "the master has not told where it runs"
        named = "not among its commanders " + ", ".join(dict.fromkeys(one.name for one in self._commanders))
        addresses = [address for one in self._commanders for address in one.addresses]
        if not addresses or _form(sender.host) in map(_form, addresses):
            return named
        # The same host under another name cannot be told from another host.
        return "{} (known as {}: was it started with another ROS_IP?)".format(named, ", ".join(addresses))


def _form(address: str) -> str:
    """How an address is written: nodes of one host that advertise it in two ways have two of them."""
    try:
        ip = ipaddress.ip_address(address)
    except ValueError:
        return "loopback" if address == "localhost" else "name"
    return "loopback" if ip.is_loopback else f"IPv{ip.version}"


def _listed(texts: Sequence[str], separator: str) -> str:
    more = len(texts) - _MOST_NAMED
    return separator.join([*texts[:_MOST_NAMED], *([f"{more} more"] if more > 0 else [])])
