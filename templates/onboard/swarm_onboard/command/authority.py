"""Who may move the robot: the sender of each command, the robot's commanders, and time. Knows no ROS.

A commander holds the robot from its first command until it has been silent for ``command_timeout``; meanwhile
only one of higher priority is obeyed. A stop is a command like any other: it lasts until the next command of
the sender that holds the robot. If anybody could stop it, the robot would stutter and nobody would be safer.
"""

from __future__ import annotations

import ipaddress
import math
from collections import OrderedDict
from dataclasses import dataclass
from typing import Any, Iterable, Iterator, Mapping, Sequence

NOBODY = "nobody"
_MOST_REFUSED = 16  # senders that are remembered
_REMEMBERED = 60.0  # s after its last command for which a refused sender is named
_RECENT = 5.0  # s for which a refusal is reported: the longest time between two reports
_MOST_NAMED = 3  # senders in one text
_MORE = "more"  # at the end of a list that is not complete; no node is called so
_LONGEST_LIST = 190  # characters; probes cut longer values


@dataclass(frozen=True)
class Commander:
    """Nodes by name, or all in a namespace, on ``hosts``; and all nodes at ``addresses``.

    Both are addresses as nodes advertise them.
    """

    name: str
    priority: int
    nodes: tuple[str, ...] = ()
    namespace: str | None = None
    hosts: tuple[str, ...] = ()
    addresses: tuple[str, ...] = ()

    def includes(self, sender: Sender) -> bool:
        """Returns True if ``sender`` is a node of this commander."""
        return sender.host in self.addresses or (
            self.names(sender.node) and (sender.host in self.hosts or sender.host == "")
        )

    def names(self, node: str) -> bool:
        """Returns True if ``node`` has a name of this commander's nodes."""
        return node in self.nodes or (self.namespace is not None and node.startswith(self.namespace + "/"))


def commander_of(data: Mapping[str, Any]) -> Commander:
    """Returns an entry of `commanders` in a parameter file.

    Raises ``KeyError``, ``TypeError`` or ``ValueError``.
    """
    return Commander(
        name=str(data["name"]),
        priority=int(data["priority"]),
        nodes=tuple(str(node) for node in data["nodes"]),
        namespace=str(data["namespace"]) if data["namespace"] is not None else None,
        hosts=tuple(str(address).lower() for address in data["hosts"]),
        addresses=tuple(str(address).lower() for address in data["addresses"]),
    )


@dataclass(frozen=True)
class Sender:
    """A node that sends commands, by the name that it claims, and the host from which they come.

    None if that is not known; empty if the graph has no hosts.
    """

    node: str
    host: str | None = None

    def __str__(self) -> str:
        return f"{self.node} on {self.host}" if self.host else self.node


@dataclass(frozen=True)
class Standing:
    """Who is obeyed now, who was refused lately, and the problem with that (empty if there is none).

    ``refused`` is for people, ``refused_nodes`` for programs: whole names, with a space between two, and
    ``more`` at the end if there are others. ``strangers`` are those of the refused that may never command.
    """

    commander: str = NOBODY
    refused: str = "none"
    complaint: str = ""
    refused_nodes: str = ""
    strangers: str = ""

    def values(self) -> Mapping[str, str]:
        """Returns what /diagnostics shows of it."""
        return {
            "commander": self.commander,
            "refused senders": self.refused,
            "refused nodes": self.refused_nodes,
            "unauthorised senders": self.strangers,
        }


@dataclass
class _Hold:
    """The sender that a priority belongs to until it has been silent for long enough.

    ``spoken`` is when any node of this priority last sent a command: lower ones wait for all of them.
    """

    commander: str
    node: str
    received: float
    spoken: float

    def __str__(self) -> str:
        return f"{self.commander} ({self.node})"


@dataclass
class _Refused:
    """A sender's refusals. ``behind``: who held the robot at the last one, ``age``: how old by its stamp that
    one of a commander was, s, if it was too old or too far ahead. Neither for no commander.
    """

    sender: Sender
    count: int
    received: float
    behind: str
    age: float

    @property
    def strange(self) -> bool:
        """True if its sender is no commander."""
        return not self.behind and not self.age


class Authority:
    """Accepts or refuses commands. Its memory is bounded by the commanders and ``_MOST_REFUSED``."""

    def __init__(self, commanders: Sequence[Commander], timeout: float) -> None:
        self._commanders = sorted(commanders, key=lambda one: -one.priority)
        self.timeout = timeout
        self._holds: dict[int, _Hold] = {}  # by priority
        self._refused: OrderedDict[Sender, _Refused] = OrderedDict()  # the latest at the end
        self._forgot = -math.inf  # when a refused sender was forgotten for lack of space

    def admits(self, sender: Sender, now: float, age: float = 0.0) -> bool:
        """Whether a command that ``sender`` sends at ``now`` is accepted; ``age``: how old its stamp is, s.

        An old command is none: it does not hold the robot. Nor does one of the future, which could come from
        a clock that hides how old it is.
        """
        commander = self._commander(sender)
        if commander is None:
            return self._refuse(sender, now)
        if abs(age) > self.timeout:
            return self._refuse(sender, now, age=age)
        hold = self._holds.get(commander.priority)
        if hold is not None and hold.node != sender.node and self._recent(hold.received, now):
            hold.spoken = now
            return self._refuse(sender, now, behind=str(hold))
        self._holds[commander.priority] = own = _Hold(commander.name, sender.node, now, now)
        above = self._highest(now)
        if above is not None and above is not own:
            return self._refuse(sender, now, behind=str(above))
        self._refused.pop(sender, None)
        return True

    def admits_setting(self, sender: Sender, now: float) -> bool:
        """Whether ``sender`` may set lights and other actuators: each commander may at any time."""
        return self._commander(sender) is not None or self._refuse(sender, now)

    def commander_name(self, sender: Sender) -> str:
        """Returns the name of the commander that ``sender`` is a node of; empty for a stranger."""
        commander = self._commander(sender)
        return commander.name if commander is not None else ""

    def _commander(self, sender: Sender) -> Commander | None:
        return next((one for one in self._commanders if one.includes(sender)), None)

    def standing(self, now: float) -> Standing:
        """Returns who is obeyed and who was refused at ``now``."""
        while self._refused and next(iter(self._refused.values())).received < now - _REMEMBERED:
            self._refused.popitem(last=False)
        lately = list(reversed(self._refused.values()))
        recent = [one for one in lately if one.received >= now - _RECENT]
        hold = self._highest(now)
        return Standing(
            commander=str(hold) if hold is not None and self._recent(hold.received, now) else NOBODY,
            refused=_listed([self._described(one) for one in lately], "; ") or "none",
            complaint="; ".join(self._complaints(recent)),
            refused_nodes=_names(
                dict.fromkeys(one.sender.node for one in lately), complete=self._forgot < now - _REMEMBERED
            ),
            strangers=_listed([self._described(one) for one in lately if one.strange], "; "),
        )

    def _described(self, refused: _Refused) -> str:
        why = f"behind {refused.behind}" if refused.behind else self._reason(refused)
        return f"{refused.sender} ({refused.count} command{'' if refused.count == 1 else 's'}): {why}"

    def _complaints(self, recent: Sequence[_Refused]) -> Iterator[str]:
        """Yields what is wrong with strangers, and with commanders whose stamps are."""
        for refused in ([one for one in recent if one.strange], [one for one in recent if one.age]):
            if refused:
                who = _listed([str(one.sender) for one in refused], ", ")
                yield f"refuses {who}: {self._reason(refused[0])}"

    def _recent(self, moment: float, now: float) -> bool:
        return now < moment + self.timeout

    def _highest(self, now: float) -> _Hold | None:
        """The hold of the highest priority with a recent command."""
        holds = (self._holds[priority] for priority in sorted(self._holds, reverse=True))
        return next((hold for hold in holds if self._recent(hold.spoken, now)), None)

    def _refuse(self, sender: Sender, now: float, *, behind: str = "", age: float = 0.0) -> bool:
        known = self._refused.pop(sender, None)
        count = known.count + 1 if known is not None else 1
        self._refused[sender] = _Refused(sender, count, now, behind, age)
        if len(self._refused) > _MOST_REFUSED:
            self._refused.popitem(last=False)
            self._forgot = now
        return False

    def _reason(self, refused: _Refused) -> str:
        if not refused.age:
            return self._strangeness(refused.sender)
        off = f"{abs(refused.age):.1f} s {'old' if refused.age > 0 else 'ahead of time'}"
        return f"its command was {off} by its stamp: check the clocks of both hosts, and `use_sim_time`"

    def _strangeness(self, sender: Sender) -> str:
        """Why a sender is not a commander."""
        if not self._commanders:
            return "nobody may command it"
        if sender.host is None:
            return "its host is not known"
        if claimed := next((one for one in self._commanders if one.names(sender.node)), None):
            return f"it has the name of a node of {claimed.name}, which is on {', '.join(claimed.hosts)}"
        named = "not among its commanders " + ", ".join(dict.fromkeys(one.name for one in self._commanders))
        addresses = [address for one in self._commanders for address in one.addresses]
        if not addresses or not sender.host or _form(sender.host) in map(_form, addresses):
            return named
        # The same host under another name cannot be distinguished from another host.
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


def _names(nodes: Iterable[str], *, complete: bool) -> str:
    """The names with a space between two, as many as fit; ``_MORE`` at the end if that is not all."""
    shown: list[str] = []
    for node in nodes:
        if any(character.isspace() for character in node):  # no name that ROS gives
            complete = False
        elif len(" ".join([*shown, node, _MORE])) <= _LONGEST_LIST:
            shown.append(node)
        else:
            complete = False
    return " ".join(shown if complete else [*shown, _MORE])
