from __future__ import annotations

from pathlib import Path

import pytest
from swarm_onboard.agent.release_store import Home
from swarm_onboard.host_checks.temperature import Seen, judge, observe


@pytest.mark.parametrize(
    ("kind", "value", "celsius"),
    [("cpu-thermal", 61_500, [61.5]), ("x86_pkg_temp", 93_000, []), ("battery", 30_000, [])],
)
def test_it_is_that_of_a_board(tmp_path: Path, kind: str, value: int, celsius: list[float]) -> None:
    zone = tmp_path / "sys/class/thermal/thermal_zone0"
    zone.mkdir(parents=True)
    (zone / "type").write_text(f"{kind}\n")
    (zone / "temp").write_text(f"{value}\n")
    assert [one.celsius for one in observe(Home("new", str(tmp_path)))] == celsius


def test_a_sensor_that_is_off_costs_the_others_nothing(tmp_path: Path) -> None:
    for number, kind in enumerate(("iwlwifi_1", "cpu-off", "soc-thermal")):
        zone = tmp_path / f"sys/class/thermal/thermal_zone{number}"
        zone.mkdir(parents=True)
        (zone / "type").write_text(f"{kind}\n")
        if kind == "soc-thermal":
            (zone / "temp").write_text("52000\n")
        else:
            (zone / "temp").mkdir()  # reading it fails
    assert observe(Home("new", str(tmp_path))) == [Seen(52.0)]


def test_without_a_sensor_it_is_not_checked(tmp_path: Path) -> None:
    assert observe(Home("new", str(tmp_path))) == []


@pytest.mark.parametrize(("celsius", "state"), [(79.4, "ok"), (84.0, "warning")])
def test_a_hot_processor_is_a_warning(celsius: float, state: str) -> None:
    found = judge(Seen(celsius), "pi")
    assert (found.state, f"{celsius:.0f} °C" in found.message) == (state, True)
