"""The mailbox of commands: only the latest counts, and a waiting thread wakes at once."""

from __future__ import annotations

import threading
import time

import pytest
from swarm_onboard.command.command_mailbox import CommandMailbox


@pytest.mark.parametrize("ring", [lambda commands: commands.put((0.1, 0, 0), (0, 0, 0)), CommandMailbox.stop])
def test_a_command_or_a_stop_ends_the_waiting(ring):
    commands = CommandMailbox()
    ringer = threading.Timer(0.05, ring, [commands])
    ringer.start()
    commands.wait(3600.0)
    ringer.join()


def test_a_bell_rings_once():
    commands = CommandMailbox()
    commands.stop()
    commands.wait(3600.0)
    start = time.monotonic()
    commands.wait(0.05)
    assert time.monotonic() - start >= 0.04


def test_commands_that_nobody_fetches_neither_block_nor_pile_up():
    commands = CommandMailbox()
    for number in range(5000):
        commands.put((number / 10_000, 0, 0), (0, 0, 0))
    assert commands.latest is not None
    assert commands.latest.velocity.forward == 0.4999
