"""A robot whose board uses rosserial is driven by swarmctl's driver, or by `rosserial_python` alone."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from swarmctl.render.build_bundle import bundles
from swarmctl.render.bundle import Bundle
from tests import ROOT
from tests.loading import load_swarm
from tests.render.rendered import text_of

GOLDEN = Path(__file__).parent / "golden/arduino-rover"
FILES = ("launch/rover.launch", "params/rover.yaml", "units/swarm-rover.rover.service")
UNIT = "swarm-rover.rover.service"


EXAMPLE = ROOT / "examples/arduino-rover/swarm.yaml"


@pytest.fixture(scope="module")
def ours() -> Bundle:
    return rendered(EXAMPLE)


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Bundle:
    """The example, with rosserial_python."""
    text = EXAMPLE.read_text("utf-8")
    foreign = text.replace("{type: arduino-rover}", "{type: arduino-rover, driver: rosserial_python}")
    assert foreign != text
    spec = tmp_path_factory.mktemp("foreign") / "swarm.yaml"
    spec.write_text(foreign, "utf-8")
    return rendered(spec)


def rendered(spec: Path) -> Bundle:
    swarm, found = load_swarm(spec)
    assert swarm is not None, found
    return bundles(swarm)["rover-pi"]


@pytest.mark.parametrize("path", FILES)
def test_golden_of_rosserial_python(path: str, bundle: Bundle, golden: Callable[[Path, str], None]) -> None:
    golden(GOLDEN / "rosserial_python" / path, text_of(bundle, path))


@pytest.mark.parametrize("path", [*FILES, "bin/keys"])
def test_golden_of_our_driver(path: str, ours: Bundle, golden: Callable[[Path, str], None]) -> None:
    golden(GOLDEN / path, text_of(ours, path))


def test_our_driver_needs_no_package_of_rosserial(ours: Bundle) -> None:
    assert "package:rosserial_python" not in ours.requires
    assert {"rospy", "pyserial"} <= set(ours.requires)
    assert "drivers/swarm_onboard/rosserial/frames.py" in [one.path for one in ours.files]
    [unit] = (one for one in ours.units if one.name == UNIT)
    assert {"params/rover.yaml", "drivers/swarm_onboard/driver/rosserial_robot.py"} <= set(unit.needs)


def test_the_host_needs_rosserial_python_and_no_driver(bundle: Bundle) -> None:
    assert "package:rosserial_python" in bundle.requires
    assert "pyserial" not in bundle.requires
    assert not [one.path for one in bundle.files if one.path.startswith("drivers/")]


def test_another_port_or_baud_restarts_it(bundle: Bundle) -> None:
    [unit] = (one for one in bundle.units if one.name == UNIT)
    assert unit.robot == "rover"
    assert {"launch/rover.launch", "params/rover.yaml", "bin/ros-client", f"units/{UNIT}"} <= set(unit.needs)
    assert "params/keys.yaml" not in unit.needs
