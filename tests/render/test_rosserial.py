"""A robot whose board speaks rosserial: `rosserial_python` is its driver, and nothing of ours is."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from swarmctl.checks.check import read
from swarmctl.render.bundle import Bundle
from swarmctl.render.host import bundles

ROOT = Path(__file__).parents[2]
GOLDEN = Path(__file__).parent / "golden/arduino-rover"
FILES = ("launch/rover.launch", "units/swarm-rover.rover.service", "bin/keys")
UNIT = "swarm-rover.rover.service"


@pytest.fixture(scope="module")
def bundle() -> Bundle:
    swarm, found = read(ROOT / "examples/arduino-rover/swarm.yaml")
    assert swarm is not None, found
    return bundles(swarm)["rover-pi"]


@pytest.mark.parametrize("path", FILES)
def test_golden(path: str, bundle: Bundle, golden: Callable[[Path, str], None]) -> None:
    [file] = (one for one in bundle.files if one.path == path)
    golden(GOLDEN / path, file.content.decode())


def test_the_host_needs_rosserial_python_and_gets_no_driver_of_ours(bundle: Bundle) -> None:
    assert "package:rosserial_python" in bundle.requires
    assert "pyserial" not in bundle.requires
    assert not [one.path for one in bundle.files if one.path.startswith(("drivers/", "params/rover"))]


def test_another_port_or_rate_restarts_it_and_another_order_does_not(bundle: Bundle) -> None:
    [unit] = (one for one in bundle.units if one.name == UNIT)
    assert unit.robot == "rover"
    assert {"launch/rover.launch", "bin/ros-client", f"units/{UNIT}"} <= set(unit.needs)
    assert "params/keys.yaml" not in unit.needs
