"""What a host reports of its disks, its memory, its processors and their temperature."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from swarm_onboard.agent.host_resources import Work, disks, memory, temperature, work
from swarm_onboard.agent.release_store import Home

ZONES = [("cpu-thermal", 61_500, 61.5), ("x86_pkg_temp", 93_000, None), ("battery", 30_000, None)]


def test_each_file_system_is_reported_once(tmp_path: Path) -> None:
    (tmp_path / "opt/swarm").mkdir(parents=True)
    (tmp_path / "etc").mkdir()
    (found,) = disks(Home("new", str(tmp_path)))
    space = os.statvfs(tmp_path)
    assert (found["used_by"], found["read_only"]) == ("/opt/swarm", False)
    assert found["size"] == space.f_blocks * space.f_frsize
    assert str(tmp_path).startswith(found["place"])


def test_memory_is_that_of_the_kernel() -> None:
    found = memory()
    assert 0 < found["available"] <= found["size"]


def test_the_share_of_work_needs_some_time() -> None:
    before = work()
    assert work().share_since(before) is None
    passed = 1000 * (os.cpu_count() or 1)
    assert Work(before.busy + passed * 3 // 4, before.all + passed).share_since(before) == 0.75


@pytest.mark.parametrize(("kind", "value", "celsius"), ZONES)
def test_the_temperature_is_that_of_a_board(
    tmp_path: Path, kind: str, value: int, celsius: float | None
) -> None:
    zone = tmp_path / "sys/class/thermal/thermal_zone0"
    zone.mkdir(parents=True)
    (zone / "type").write_text(f"{kind}\n")
    (zone / "temp").write_text(f"{value}\n")
    assert temperature(Home("new", str(tmp_path))) == celsius


def test_without_a_sensor_the_temperature_is_unknown(tmp_path: Path) -> None:
    assert temperature(Home("new", str(tmp_path))) is None
