"""The mailbox of orders: only the latest counts, and whoever waits hears of it at once."""

from __future__ import annotations

import threading
import time

import pytest
from swarm_driver.orders import Orders


@pytest.mark.parametrize("ring", [lambda orders: orders.put((0.1, 0, 0), (0, 0, 0)), Orders.stop])
def test_an_order_or_a_stop_ends_the_waiting(ring):
    orders = Orders()
    ringer = threading.Timer(0.05, ring, [orders])
    start = time.monotonic()
    ringer.start()
    orders.wait(10.0)
    assert time.monotonic() - start < 5.0
    ringer.join()


def test_a_bell_that_was_heard_is_silent_again():
    orders = Orders()
    orders.stop()
    orders.wait(10.0)
    start = time.monotonic()
    orders.wait(0.05)
    assert time.monotonic() - start >= 0.04


def test_orders_that_nobody_fetches_neither_block_nor_pile_up():
    orders = Orders()
    for number in range(5000):
        orders.put((number / 10_000, 0, 0), (0, 0, 0))
    assert orders.latest is not None
    assert orders.latest.linear == 0.4999
