"""How a peer is doing: when it was heard, what it offers, whether links must be renewed. Values, no clock.

A rospy subscriber whose connection broke never connects by itself; it looks for publishers when the master
tells it who publishes (rospy 1.15, impl/registration.py). To register a publisher once more makes the master
do that, and harms no connection that holds. What broke in silence, TCP keepalive finds out in 60 to 150 s.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass, replace

from swarm_sync.config import Config
from swarm_sync.graph import Entry

#: s after a silence at which publishers are registered once more.
RENEWALS = (0.0, 10.0, 30.0, 75.0, 160.0)


class State(enum.Enum):
    """``WAITING`` was never heard; ``SILENT`` may come back; of ``AWAY`` the publishers are taken out."""

    WAITING = "not heard yet"
    CONNECTED = "connected"
    SILENT = "silent"
    AWAY = "away"


@dataclass(frozen=True)
class Refusal:
    """A publisher that is not brought here, and why."""

    topic: str
    node: str
    why: str


@dataclass(frozen=True)
class Offer:
    """What a peer has for this island."""

    entries: frozenset[Entry] = frozenset()
    refusals: tuple[Refusal, ...] = ()


@dataclass(frozen=True)
class Contact:
    """What is known of a peer. Times in s of one clock; ``since`` is when it was first waited for."""

    since: float
    offer: Offer = Offer()
    heard: float | None = None
    healed: float | None = None
    renewals: int = 0
    problem: str = ""


def met(contact: Contact, offer: Offer, now: float, silent_after: float) -> Contact:
    """The peer has answered."""
    silent = contact.heard is None or now - contact.heard >= silent_after
    renewed = replace(contact, healed=now, renewals=0) if silent else contact
    return replace(renewed, offer=offer, heard=now, problem="")


def missed(contact: Contact, problem: str) -> Contact:
    """The peer has not answered, or not as it should."""
    return replace(contact, problem=problem)


def state_of(contact: Contact, now: float, config: Config) -> State:
    gap = now - (contact.since if contact.heard is None else contact.heard)
    if gap >= config.remove_after:
        return State.AWAY
    if contact.heard is None:
        return State.WAITING
    return State.SILENT if gap >= config.silent_after else State.CONNECTED


def offered_by(contact: Contact, now: float, config: Config) -> frozenset[Entry]:
    """What of the peer is to be registered here now."""
    return frozenset() if state_of(contact, now, config) is State.AWAY else contact.offer.entries


def renewal_due(contact: Contact, now: float) -> bool:
    """Whether the peer's publishers are to be registered once more."""
    if contact.healed is None or contact.renewals >= len(RENEWALS):
        return False
    return now - contact.healed >= RENEWALS[contact.renewals]


def renewed(contact: Contact, now: float) -> Contact:
    """They were. Renewals whose time has passed meanwhile are one."""
    if contact.healed is None:
        return contact
    passed = sum(now - contact.healed >= age for age in RENEWALS)
    return replace(contact, renewals=max(contact.renewals, passed))
