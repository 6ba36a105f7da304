"""The firmware with its default settings, compiled once; a bench with a board that runs it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from swarmctl.firmware import compiler
from swarmctl.firmware.compiler import Built, build
from swarmctl.lab.emulators.arduino_rover import SimulatedBoard
from swarmctl.lab.emulators.uno import program
from swarmctl.lab.errors import LabError
from swarmctl.render.sketch import FirmwareSettings, sketch
from tests.firmware.firmware_bench import Bench


@pytest.fixture(scope="session")
def tools() -> compiler.Toolchain:
    try:
        return compiler.find()
    except compiler.FirmwareError as error:
        pytest.skip(f"{error} ({error.help_lines[0]})")


@pytest.fixture(scope="session")
def build_firmware(
    tools: compiler.Toolchain, tmp_path_factory: pytest.TempPathFactory
) -> Callable[[FirmwareSettings], Built]:
    def built(settings: FirmwareSettings) -> Built:
        made = sketch("rover", settings)
        return build("rover", made.sources, tmp_path_factory.mktemp("firmware"), tools)

    return built


@pytest.fixture(scope="session")
def firmware(build_firmware: Callable[[FirmwareSettings], Built]) -> Built:
    return build_firmware(FirmwareSettings())


@pytest.fixture
def boards(firmware: Built) -> Iterator[Callable[..., SimulatedBoard]]:
    """Boards that are switched off in the end. They run the default firmware unless another is given."""
    try:
        program()
    except LabError as error:
        pytest.skip(f"{error} ({error.help_lines[0]})")
    made: list[SimulatedBoard] = []

    def board(hexfile: Path = firmware.hex, **options: Any) -> SimulatedBoard:
        made.append(SimulatedBoard(hexfile, **options))
        return made[-1]

    yield board
    for one in made:
        one.close()


@pytest.fixture
def bench(boards: Callable[..., SimulatedBoard]) -> Callable[..., Bench]:
    """A board and a host that has negotiated with it."""

    def on_the_bench(**options: Any) -> Bench:
        return Bench(boards(**options)).negotiated()

    return on_the_bench
