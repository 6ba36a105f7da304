"""The dead-man with a fake clock: a command holds for its timeout, and not longer."""

from __future__ import annotations

import pytest
from swarm_onboard.command.command_mailbox import CommandMailbox
from swarm_onboard.command.dead_man import DeadMan


@pytest.mark.parametrize(("age", "holds"), [(0.0, True), (0.49, True), (0.5, False), (4.9, False)])
def test_a_command_holds_for_its_timeout(age: float, holds: bool) -> None:
    now = 10.0
    commands = CommandMailbox(lambda: now)
    dead_man = DeadMan(commands, 0.5, lambda: now)
    commands.put((0.1, 0.0, 0.0), (0.0, 0.0, 0.0))
    now += age

    assert (dead_man.in_force() is not None) == holds
    assert dead_man.due() == 10.5
