from __future__ import annotations

from pathlib import Path

import pytest
from swarm_onboard.agent.release_store import Home
from swarm_onboard.host_checks.power import Seen, judge, observe

FIRMWARE = "sys/devices/platform/soc/soc:firmware/get_throttled"


def write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


def test_the_bits_are_those_of_the_firmware(tmp_path: Path) -> None:
    write(tmp_path / FIRMWARE, "50005\n")
    assert observe(Home("new", str(tmp_path))) == [Seen(0x50005)]


@pytest.mark.parametrize("alarm", [0, 1])
def test_other_kernels_report_the_voltage_alone(tmp_path: Path, alarm: int) -> None:
    for number, name in enumerate(("cpu_thermal", "rpi_volt")):
        write(tmp_path / f"sys/class/hwmon/hwmon{number}/name", f"{name}\n")
    write(tmp_path / "sys/class/hwmon/hwmon1/in0_lcrit_alarm", f"{alarm}\n")
    assert observe(Home("new", str(tmp_path))) == [Seen(alarm)]


def test_another_computer_is_not_checked(tmp_path: Path) -> None:
    assert observe(Home("new", str(tmp_path))) == []


@pytest.mark.parametrize(
    ("bits", "state", "message"),
    [
        (0, "ok", "is right"),
        (0x50005, "warning", "the voltage is too low"),
        (0x50000, "warning", "the voltage was too low since it booted"),
        (0x8, "warning", "the processor is slowed down"),
        (0x40000, "warning", "the processor was slowed down since it booted"),
    ],
)
def test_the_worst_bit_is_named(bits: int, state: str, message: str) -> None:
    found = judge(Seen(bits), "pi")
    assert (found.state, message in found.message) == (state, True)
