"""A robot that `swarmctl stop` has stopped: status names who did, and the swarm is not unhealthy for it."""

from __future__ import annotations

from pathlib import Path

import pytest
from swarm_onboard.agent import stop_latches
from swarm_onboard.agent.release_store import Home
from swarm_onboard.agent.stop_latches import Latch

from swarmctl.cli.next_command import completing
from swarmctl.cli.spec_args import file


def test_the_latches_of_a_host_are_read_with_who_and_when(tmp_path: Path) -> None:
    home = Home("lab", str(tmp_path))
    stop_latches.close(home, ["k3"], stop_latches.Latch("me@desk (1)", 1_700_000_000.0))
    stop_latches.close(home, ["k3", "other"], stop_latches.Latch("you@desk (2)", 1_800_000_000.0))
    assert stop_latches.closed(home) == {
        "k3": Latch("me@desk (1)", 1_700_000_000.0),  # the first stop is the one that counts
        "other": Latch("you@desk (2)", 1_800_000_000.0),
    }


def test_a_released_robot_has_no_latch(tmp_path: Path) -> None:
    home = Home("lab", str(tmp_path))
    stop_latches.close(home, ["k3"], stop_latches.Latch("me", 1.0))
    assert stop_latches.release(home, ["k3"]) == ["k3"]
    assert stop_latches.closed(home) == {}


def test_a_damaged_latch_is_still_one(tmp_path: Path) -> None:
    home = Home("lab", str(tmp_path))
    stop_latches.close(home, ["k3"], stop_latches.Latch("me", 1.0))
    next((tmp_path / "etc/swarm/lab/stopped").iterdir()).write_text("")
    assert stop_latches.closed(home) == {"k3": ("somebody", 0.0)}


def test_a_removed_swarm_leaves_no_latch(tmp_path: Path) -> None:
    home = Home("lab", str(tmp_path))
    stop_latches.close(home, ["k3"], stop_latches.Latch("me", 1.0))
    stop_latches.forget(home)
    assert not (tmp_path / "etc/swarm").exists()
    stop_latches.forget(home)


@pytest.mark.parametrize("where", [["--lab"], ["--lab", "--limit", "pi-1"]])
def test_the_hint_can_be_typed(where: list[str]) -> None:
    complete = completing(file("a.yaml"), where)
    assert complete("`swarmctl start SPEC k3` lets") == "`swarmctl start a.yaml --lab k3` lets"
