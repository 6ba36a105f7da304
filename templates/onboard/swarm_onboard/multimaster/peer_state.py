"""The state of a peer: when it last answered, what it offers, whether links must be renewed. No clock.

A rospy subscriber whose connection broke never reconnects by itself, but only when the master sends it the
publishers (rospy 1.15, impl/registration.py). Registering a publisher once more makes the master do that, and
does not affect working connections. TCP keepalive detects a connection that broke unnoticed in 60 to 150 s.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass, replace

from swarm_onboard.multimaster.config import Config
from swarm_onboard.multimaster.graph import Entry

#: s after a peer is back at which its publishers are registered once more.
RENEWALS = (0.0, 10.0, 30.0, 75.0, 160.0)


class State(enum.Enum):
    """``WAITING`` never answered; ``SILENT`` may come back; the publishers of ``AWAY`` are removed."""

    WAITING = "no answer yet"
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
    """What is known of a peer. Times in s; ``since``: start of this node; ``healed``: return of the peer."""

    since: float
    offer: Offer = Offer()
    last_seen: float | None = None
    healed: float | None = None
    renewals: int = 0
    problem: str = ""


def met(contact: Contact, offer: Offer, now: float, silent_after: float) -> Contact:
    """The peer has answered."""
    silent = contact.last_seen is None or now - contact.last_seen >= silent_after
    renewed = replace(contact, healed=now, renewals=0) if silent else contact
    return replace(renewed, offer=offer, last_seen=now, problem="")


def missed(contact: Contact, problem: str) -> Contact:
    """The peer has not answered, or its answer is invalid."""
    return replace(contact, problem=problem)


def state_of(contact: Contact, now: float, config: Config) -> State:
    """Returns the state of a peer at ``now``."""
    gap = now - (contact.since if contact.last_seen is None else contact.last_seen)
    if gap >= config.remove_after:
        return State.AWAY
    if contact.last_seen is None:
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
    """The publishers were registered once more: counts all renewals whose time has passed as done."""
    if contact.healed is None:
        return contact
    passed = sum(now - contact.healed >= age for age in RENEWALS)
    return replace(contact, renewals=max(contact.renewals, passed))
