"""A lab with the example's rover: its own firmware, built from the spec, on a simulated UNO."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from swarmctl.firmware import compiler
from swarmctl.lab.emulators.uno import program
from swarmctl.lab.errors import LabError
from tests import ROOT
from tests.e2e.lab_swarm import SOURCE, SWARM, LabSwarm, lab_of

EXAMPLE = ROOT / "examples/arduino-rover/swarm.yaml"
HOST, ROBOT = "rover-pi", "rover"
SPEED = 0.35  # m/s
WHEELS = ("lwheel", "rwheel")  # the topics of its counts
PULSE = math.tau * 0.0325 / 20  # m that a wheel rolls
PATIENCE = 40.0  # s: rosserial_python misses a board after 15, and may take 5 to see that it is silent


@contextmanager
def rover_lab(name: str, workplace: Path, *options: str, driver: str = "swarmctl") -> Iterator[LabSwarm]:
    """The example, deployed, where people on the host may command as well."""
    try:
        compiler.find()
        program()
    except (compiler.FirmwareError, LabError) as error:
        pytest.skip(str(error))
    folder = workplace / f"{name}-spec"
    folder.mkdir()
    spec = folder / "swarm.yaml"
    text = EXAMPLE.read_text().replace("by: keys, of", f"by: {HOST}, of")
    text = text.replace("{type: arduino-rover}", f"{{type: arduino-rover, driver: {driver}}}", 1)
    spec.write_text(text.replace("name: rover\n", f"name: {SWARM}\n", 1))
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        with lab_of(name, spec, workplace, "--boards", *options) as swarm:
            run = swarm.deploy()
            assert run.status == 0, run.out + run.err
            yield swarm


def pulses(swarm: LabSwarm, wheel: str) -> int:
    """The next count on a wheel's topic, waited for."""
    command = f"{SOURCE}; timeout {PATIENCE:g} rostopic echo -n 1 -p /{ROBOT}/{wheel}"
    _, values = swarm.shell(HOST, command, PATIENCE + 5).strip().splitlines()
    return int(values.split(",")[1])
