"""``swarmctl top`` on a terminal."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from swarmctl.cli import console, exit_codes
from swarmctl.cli.app import run
from swarmctl.health import host_costs
from swarmctl.health.host_costs import UnitCost
from tests.cli.test_width import Terminal


class Costs:
    """Stands for the hosts: one look, then Ctrl-C."""

    def __init__(self, *_: object) -> None:
        self._looks: Iterator[dict[str, list[UnitCost]]] = iter(
            [{"k3-pi": [UnitCost("k3-pi", "k3", 0.11, 53_000_000, 1)]}]
        )

    def latest(self) -> dict[str, list[UnitCost]]:
        for look in self._looks:
            return look
        raise KeyboardInterrupt


def test_it_is_live_until_ctrl_c(leader_spec: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    screen = Terminal()
    monkeypatch.setenv("HOME", str(leader_spec.parent))
    monkeypatch.setattr(host_costs, "HostCosts", Costs)
    monkeypatch.setattr(sys, "stdout", screen)
    console._console.cache_clear()
    try:
        assert run(["top", str(leader_spec), "--every", "0.5"]) == exit_codes.OK
    finally:
        console._console.cache_clear()
    assert "k3-pi" in screen.getvalue()
