"""A number may be written with its unit, and every quantity of a spec knows its own."""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.cli.app import run
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.schema.json_schema import schema_of
from swarmctl.spec.model import Computers, Spec
from swarmctl.units import _KINDS, X_UNIT, Unit, UnitError
from tests.loading import load_checked
from tests.timing import work_at_most

ROOT = Path(__file__).parents[1]
EXAMPLE = ROOT / "examples/paper-leader/swarm.yaml"
UNITS = [(kind, units) for kind, units, _ in _KINDS]

SPEC = """\
version: 1
name: lab
mode: single-minded
leader: pc
hosts:
  pc: {address: 10.0.0.1}
robots:
  k1: {type: koala, settings: {%s}}
links:
  - {kind: serial, host: pc, robot: k1, device: /dev/ttyS0}
time: {root: pc}
"""


def written(folder: Path, settings: str) -> Path:
    file = folder / "swarm.yaml"
    file.write_text(SPEC % settings)
    return file


def findings(folder: Path, settings: str) -> list[str]:
    """All texts of each finding in a Koala's settings."""
    found = load_checked(written(folder, settings))[1]
    return [" ".join((one.message, one.label, *one.help)) for one in found]


@pytest.mark.parametrize(
    ("unit", "text", "number"),
    [
        ("m", "28.5 cm", 0.285),
        ("m", "28.5cm", 0.285),
        ("m", "28.5\u00a0cm", 0.285),
        ("m", "11 in", 0.2794),
        ("m", "45 µm", 4.5e-5),
        ("m", "45 μm", 4.5e-5),  # the Greek letter
        ("m", "4.5e-2 mm", 4.5e-5),
        ("m", "-3 cm", -0.03),
        ("m", "0.29 m", 0.29),
        ("deg", "0.7 rad", math.degrees(0.7)),
        ("deg", "40°", 40),
        ("deg", "0.25 turn", 90),
        ("s", "200 ms", 0.2),
        ("s", "2 min", 120),
        ("Hz", "600 1/min", 10),
        ("m/s", "30 cm/s", 0.3),
        ("m/s", "3.6 km/h", 1),
        ("rad/s", "90 deg/s", math.pi / 2),
        ("rad/s", "60 rpm", 2 * math.pi),
        ("m/s²", "50 cm/s^2", 0.5),
        ("m/s²", "0.5 m/s2", 0.5),
        ("V", "20 mV", 0.02),
        ("MB", "2 GB", 2000),
        ("MB", "1 GiB", 1073.741824),
        ("Mbit/s", "1 Gbit/s", 1000),
        ("Mbit/s", "4 MB/s", 32),
        ("baud", "115.2 kbaud", 115200),
    ],
)
def test_text_with_a_unit_is_the_number_in_the_keys_own(unit: str, text: str, number: float) -> None:
    assert Unit(unit).read(text) == pytest.approx(number, rel=1e-12)


@given(st.sampled_from(UNITS), st.integers(-(10**9), 10**9), st.integers(0, 6), st.data())
def test_there_and_back_again_is_the_same_number(
    kind: tuple[str, dict[str, str]], digits: int, places: int, data: st.DataObject
) -> None:
    first, second = (data.draw(st.sampled_from(sorted(kind[1]))) for _ in range(2))
    number = digits / 10**places
    there = Unit(second).read(f"{number:.{places}f} {first}")
    one = Unit(first).read(f"1 {second}")
    assert there * one == pytest.approx(number, rel=1e-9)


def attempted(text: str) -> tuple[Any, str | None]:
    """What a length reads, or what its error says was meant."""
    try:
        return Unit("m").read(text), None
    except UnitError as error:
        return None, error.meant


@given(st.text(max_size=60) | st.from_regex(r"[-+.0-9e, ]{1,12}[a-zA-Zµ°/^*(\"' ]{0,10}", fullmatch=True))
def test_any_text_is_read_refused_or_left_alone(text: str) -> None:
    read, meant = attempted(text)
    assert meant is None or math.isfinite(float(Unit("m").read(meant)))
    assert read is None or read is text or math.isfinite(read)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("28.5 cn", ("not a unit of a length", "did you mean")),
        ("28.5 kg", ("not a unit of a length", "use one of m, cm")),
        ("300 ms", ("is a time, and this is a length",)),
        ("28.5 CM", ("write 28.5 cm",)),
        ('11"', ("write 11 in",)),
        ("28.5 meters", ("write 28.5 m",)),
        ("28,5 cm", ("decimal point", "28.5 cm")),
        ("1,250 mm", ("1.250 mm", "or 1250 mm")),
        ("5 MHz", ("not a unit of a length",)),
    ],
)
def test_a_wrong_unit_is_named_with_what_to_write(text: str, words: tuple[str, ...]) -> None:
    with pytest.raises(UnitError) as caught:
        Unit("m").read(text)
    assert all(word in str(caught.value) for word in words), str(caught.value)


def test_bits_are_not_taken_for_bytes() -> None:
    with pytest.raises(UnitError) as caught:
        Unit("Mbit/s").read("5 mB/s")
    assert caught.value.meant == "5 MB/s"
    with pytest.raises(UnitError) as caught:
        Unit("MB").read("5 mb")
    assert caught.value.meant is None


@pytest.mark.parametrize("text", ["0.285", "wide", "1_000", "1.2.3", "1e400", "10 - 20 m", "(1+1) m", ""])
def test_what_is_no_quantity_is_left_to_the_check_of_numbers(text: str) -> None:
    assert Unit("m").read(text) == text


def test_hostile_text_costs_nothing() -> None:
    with work_at_most(20):
        for text in ("9" * 10_000_000, "1 " + "m" * 10_000_000, "1" + " " * 10_000_000, "9**9**9 m"):
            assert Unit("m").read(text) is text


def test_a_spec_with_units_is_the_spec_without(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    units = "command_timeout: 300 ms, limits: {linear: 30 cm/s, angular: 90 deg/s}"
    assert run(["spec", str(written(tmp_path, units)), "--expanded", "--json"]) == 0
    settings = yaml.safe_load(capsys.readouterr().out)["spec"]["robots"]["k1"]["settings"]
    assert settings["command_timeout"] == 0.3
    assert settings["limits"] == {"linear": 0.3, "angular": pytest.approx(math.pi / 2)}


def test_a_bound_has_its_unit_and_the_value_its_own_words(tmp_path: Path) -> None:
    (found,) = findings(tmp_path, "limits: {linear: 3000 km/h}")
    assert "`linear` cannot be `3000 km/h`" in found
    assert "must be 100 m/s or less" in found
    (found,) = findings(tmp_path, "rates: {odom: 99}")
    assert "must be 50 Hz or less" in found


def test_a_decimal_comma_is_fixed(tmp_path: Path) -> None:
    file = written(tmp_path, "calibration:\n      {wheel_separation: '28,5 cm'}")
    assert run(["validate", str(file), "--fix"]) == 0
    assert "28.5 cm" in file.read_text()


def test_a_comma_within_braces_is_explained(tmp_path: Path) -> None:
    found = findings(tmp_path, "calibration: {wheel_separation: 0,285}")
    assert any("a comma ends a value" in one for one in found)


def test_ranges_and_overlays_may_have_units(tmp_path: Path) -> None:
    file = tmp_path / "swarm.yaml"
    file.write_text(
        SPEC.replace("k1: {type", "k[1-2]: {type")
        .replace("/dev/ttyS0", '"/dev/ttyS[1-2]"')
        .replace("robot: k1", 'robot: "k[1-2]"')
        % "calibration: {wheel_separation: {each: [28 cm, 290 mm]}}"
    )
    over = tmp_path / "over.yaml"
    over.write_text("robots: {k2: {settings: {calibration: {wheel_separation: 0.3 m}}}}\n")
    document, found = load_checked(file, over)
    assert document is not None, found
    of = [document.spec.robots[name].settings.calibration.wheel_separation for name in ("k1", "k2")]
    assert of == [0.28, 0.3]


def test_a_spec_without_units_loads_no_pint() -> None:
    code = "import sys; from swarmctl.cli.app import run; run(sys.argv[1:]); print('pint' in sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", code, "validate", str(EXAMPLE)], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip().endswith("False")


@pytest.mark.parametrize(
    ("value", "valid"),
    [
        (0.285, True),
        ("28.5 cm", True),
        ("285mm", True),
        (1000, False),
        ("28.5 kg", False),
        ("28,5 cm", False),
    ],
)
def test_editors_accept_units(value: Any, valid: bool) -> None:
    kinematics = schema_of("robot-type")["definitions"]["Kinematics"]["properties"]["wheel_separation"]
    assert jsonschema.Draft7Validator(kinematics).is_valid(value) == valid


# Numbers that measure nothing: counts, ids, ratios, and what has the unit of another key.
WITHOUT = {
    "version", "port", "local_ports", "master_port", "priority", "cores", "channel", "rfcomm_channel",
    "bytesize", "domain", "stopbits", "counter_bits", "counts_per_turn", "pulses_per_turn", "distance_scale",
    "max_reading", "battery", "low", "empty", "trials", "count", "parameters",
    "none_from", "none_below", "invalid_from", "stride", "first", "order", "zero", "scale", "offset",
    "max", "values", "vars", "extra", "request", "reply", "begins", "linear", "angular", "firmware_below",
    "speed_units_per_mps", "distances", "params", "args", "options", "encoder", "enable", "forward",
    "backward", "pwm_min", "kp", "ki", "width", "height", "zoom", "modes", "chip", "interface", "system_id",
}  # fmt: skip


def numbers_in(schema: Any, key: str = "") -> Iterator[tuple[str, dict[str, Any]]]:
    """Every number of a schema, with the key that it belongs to."""
    if isinstance(schema, dict):
        if schema.get("type") in ("number", "integer"):
            yield key, schema
        for word, below in schema.items():
            named = word in ("properties", "$defs", "definitions")
            for inner, one in below.items() if named else ((key, below),):
                yield from numbers_in(one, inner)
    elif isinstance(schema, list):
        for one in schema:
            yield from numbers_in(one, key)


@pytest.mark.parametrize("model", [Spec, RobotType, Computers])
def test_every_quantity_has_a_unit(model: Any) -> None:
    bare = {key for key, one in numbers_in(model.model_json_schema()) if X_UNIT not in one}
    assert bare <= WITHOUT
