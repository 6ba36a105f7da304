"""What the units of a swarm take, from the processes in their control groups."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from swarm_onboard.agent import control_groups
from swarm_onboard.agent.rpc import Report
from swarm_onboard.agent.verbs import costs

from tests.onboard.agent.test_stop import SWARM


def group(slices: Path, unit: str, *pids: int) -> Path:
    folder = slices / unit
    folder.mkdir(parents=True)
    (folder / "cgroup.procs").write_text("".join(f"{pid}\n" for pid in pids))
    return folder


def reported() -> costs.Answer:
    return costs.handle(costs.Request(SWARM), b"", Report("n"))


def test_a_unit_takes_what_its_processes_take(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(control_groups, "SLICES", (str(tmp_path), str(tmp_path / "none")))
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as other:
        own = group(tmp_path, f"swarm-{SWARM}.k3.service", os.getpid())
        group(own, "payload", other.pid)  # as containers have
        group(tmp_path, f"swarm-{SWARM}.koala.service", 2**22 + 1)  # which has just ended
        group(tmp_path, f"swarm-{SWARM}.target")
        group(tmp_path, "swarm-other.k3.service", os.getpid())
        units = reported().units
        other.communicate(b"\n")
    assert sorted(units) == [f"swarm-{SWARM}.k3.service", f"swarm-{SWARM}.koala.service"]
    k3, koala = units.values()
    assert k3.processes == 2
    assert k3.cpu > 0
    resident = Path("/proc/self/statm").read_text().split()[1]
    assert k3.memory > int(resident) * os.sysconf("SC_PAGE_SIZE") / 2
    assert koala == costs.UnitCosts(0.0, 0, 0)
