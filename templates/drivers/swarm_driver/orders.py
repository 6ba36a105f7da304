"""The mailbox between who gives orders and the thread that owns the line: the latest order, and a bell."""

from __future__ import annotations

import contextlib
import math
import select
import socket
import time
from dataclasses import dataclass
from typing import Any, Callable, Sequence

from swarm_driver.kinematics import plausible


@dataclass(frozen=True)
class Order:
    """Drive so: m/s forward, rad/s to the left. ``stamp`` is when it arrived, on the monotonic clock."""

    linear: float
    angular: float
    stamp: float


class Orders:
    """Holds one order, never a queue: an order that was overtaken is not worth executing.

    ``put``, ``stop`` and ``wait`` may run in different threads: each sets one attribute and rings a socket.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self.latest: Order | None = None
        self.stopped = False
        self.refused = 0
        self._listen, self._bell = socket.socketpair()
        self._bell.setblocking(False)

    def put(self, linear: Sequence[float], angular: Sequence[float], arrived: float | None = None) -> None:
        """Take a Twist: x forward and z to the left count. A senseless component makes it a stop."""
        sane = plausible((*linear, *angular))
        self.refused += not sane
        stamp = self._clock() if arrived is None else arrived
        self.latest = Order(linear[0] if sane else 0.0, angular[2] if sane else 0.0, stamp)
        self.ring()

    def stop(self) -> None:
        """No more orders: whoever waits comes back to end."""
        self.stopped = True
        self.ring()

    def wait(self, seconds: float, others: Sequence[Any] = ()) -> None:
        """Sleep, but no longer than until somebody rings or one of ``others`` can be read."""
        ready, _, _ = select.select([self._listen, *others], [], [], max(0.0, seconds))
        if self._listen in ready:
            self._listen.recv(4096)

    def ring(self) -> None:
        """Wake who waits."""
        with contextlib.suppress(BlockingIOError):  # the bell is ringing already
            self._bell.send(b"!")


class DeadMan:
    """Holds an order in force for ``timeout`` seconds after it arrived, then lets the robot stand.

    An order from before the dead-man's own beginning was meant for another moment.
    """

    def __init__(self, orders: Orders, timeout: float, clock: Callable[[], float]) -> None:
        self.since = clock()
        self._orders = orders
        self._timeout = timeout
        self._clock = clock

    def in_force(self) -> Order | None:
        return self._given() if self._clock() < self.due() else None

    def due(self) -> float:
        """When the latest order is over."""
        order = self._given()
        return order.stamp + self._timeout if order is not None else -math.inf

    def activity(self, moving: bool) -> str:
        """What the robot is doing, in words."""
        if self.in_force() is not None:
            return "driving" if moving else "standing still, as ordered"
        silence = "no order yet" if self._given() is None else f"no order for {self._timeout:g} s"
        return f"standing still: {silence}"

    def _given(self) -> Order | None:
        order = self._orders.latest
        return order if order is not None and order.stamp >= self.since else None
