"""Parameters arrive in a real node as they are written: those that `validate` accepts, of any type."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from swarmctl.render.ros2.node_words import node_params
from swarmctl.render.yaml_params import params_file
from swarmctl.ros_packages.parameters import ParameterFileError, for_rcl, read_file, reads_section, refusals
from tests.render.reader_of import Reader, reader_of
from tests.render.rendered import bundle_of, text_of

pytestmark = pytest.mark.lab
NODE = "/k3/scan"
EXAMPLES = int(os.environ.get("SWARMCTL_FUZZ", "200"))
LONG = settings(
    max_examples=EXAMPLES, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)

#: Texts that some reader of YAML takes for something else.
TRAPS = (
    "y", "N", "yes", "Off", "null", "~", "1e5", "nan", "inf", "-.inf", "Infinity", "nan(7)", "08", "010",
    "0x1p3", "0b11", "0o7", "1_000", "1:30", "2001-01-01", "+1", ".5", "5.", "deg(90)", "rad(pi)", "", " ",
    "- a", "a: b", "a #b", "#", "*a", "&a", "!x", "{a}", "[1]", "<<", "=", "é", "\U0001f600", "a\nb", "\ta",
    "it's", '"',
)  # fmt: skip
TEXTS = st.sampled_from(TRAPS) | st.text(
    st.characters(
        codec="utf-8", exclude_categories=("Cc", "Cs"), exclude_characters="\u2028\u2029\ufffe\uffff"
    )
    | st.sampled_from("\n\t"),
    max_size=12,
)
SCALARS = (
    st.booleans() | st.integers(-(1 << 65), 1 << 65) | st.integers()
    | st.floats(allow_nan=False, allow_infinity=False) | TEXTS
)  # fmt: skip
LISTS = st.one_of(
    *(st.lists(one, max_size=5) for one in (st.booleans(), st.integers(), st.floats(-9, 9), TEXTS, SCALARS)),
    st.lists(st.integers() | st.floats(-9, 9), min_size=1, max_size=5),
)
KEYS = st.text("abcdxyz_019", min_size=1, max_size=4) | st.sampled_from(
    ["y", "1e5", "a.b", "a b", "é", "ros__parameters"]
)
VALUES = st.recursive(
    SCALARS | LISTS,
    lambda inside: st.dictionaries(KEYS, inside, max_size=3) | st.lists(inside, max_size=3),
    max_leaves=6,
)
PARAMETERS = st.dictionaries(KEYS, VALUES, min_size=1, max_size=4)


@pytest.fixture(scope="module", params=["jazzy", "kilted"])
def rcl(request: pytest.FixtureRequest) -> Iterator[Reader]:
    yield from reader_of(request.param)


@pytest.fixture(scope="module")
def rosparam() -> Iterator[Reader]:
    yield from reader_of("")


def marked(value: Any) -> Any:
    """A value as the nodes print it, in which 1.0 is not 1."""
    if isinstance(value, float):
        return {"float": value.hex()}
    return [marked(one) for one in value] if isinstance(value, (list, tuple)) else value


def flat(params: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """The parameters by their full names in ROS 2."""
    for key, value in params.items():
        if isinstance(value, Mapping):
            yield from flat(value, f"{before}{key}.")
        else:
            yield f"{before}{key}", marked(value)


def nested(value: Any) -> Any:
    """The parameters as a master of ROS 1 has them: an empty mapping sets none."""
    if isinstance(value, Mapping):
        return {"map": {key: nested(one) for key, one in value.items()}}
    return [nested(one) for one in value] if isinstance(value, (list, tuple)) else marked(value)


def without_empty(params: Mapping[str, Any]) -> dict[str, Any]:
    kept = {key: without_empty(one) if isinstance(one, Mapping) else one for key, one in params.items()}
    return {key: one for key, one in kept.items() if one != {}}


def divided(params: Mapping[str, Any], reader: Any) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """The parameters that are accepted, and each of the others alone."""
    refused = {str(one.loc[0]) for one in refusals(params, reader)}
    accepted = {key: value for key, value in params.items() if key not in refused}
    return accepted, [{key: params[key]} for key in refused if key in params]


@LONG
@given(PARAMETERS)
@example({"texts": list(TRAPS)})
@example({one: one for one in TRAPS if one})
def test_a_node_of_ros2_gets_what_is_accepted(rcl: Reader, params: Mapping[str, Any]) -> None:
    accepted, refused = divided(params, "rcl")
    assert rcl.read(node_params(accepted).decode()) == {"values": dict(flat(for_rcl(accepted)))}
    for one in refused:
        if list(refusals(one, "rcl")):
            assert rcl.read(node_params(one).decode()) != {"values": dict(flat(one))}


@LONG
@given(PARAMETERS)
@example({one: one for one in TRAPS if one != "~"})  # PROG010
@example({"texts": list(TRAPS)})
def test_a_node_of_ros1_gets_what_is_accepted(rosparam: Reader, params: Mapping[str, Any]) -> None:
    accepted, refused = divided(params, "rosparam")
    assert rosparam.read(params_file(accepted).decode()) == {"values": nested(without_empty(accepted))}
    for one in refused:
        if list(refusals(one, "rosparam")):
            assert rosparam.read(params_file(one).decode()) != {"values": nested(without_empty(one))}


PLAIN = st.text("0123456789.eEpPxX+-_infatyoNY~ab() ", min_size=1, max_size=7).map(str.strip)


@LONG
@given(PLAIN)
@example("0x.8p1")
@example("1e400")
@example("5.0e-324")
@example("9223372036854775808")
def test_a_text_without_quotes_is_what_rcl_reads(rcl: Reader, text: str) -> None:
    file = section("/**", f"a: {text}")
    try:
        found = read_file(file.encode(), "rcl").nodes["/**"]
    except ParameterFileError:
        assert "error" in rcl.read(file)
        return
    assert rcl.read(file) == {"values": dict(flat(found))}


STEPS = st.sampled_from(["k3", "scan", "*", "**", "x", "a b", "9", ""])


@LONG
@given(st.lists(st.lists(STEPS, min_size=1, max_size=4).map("/".join), min_size=1, max_size=3, unique=True))
@example(["/**", "scan", "k3/scan", "/*/scan", "/**/k3/scan", "*", "/k3/*"])
def test_a_node_reads_the_sections_that_are_for_it(rcl: Reader, names: list[str]) -> None:
    file = "".join(section(json.dumps(name), f"p{number}: true") for number, name in enumerate(names))
    try:
        nodes = read_file(file.encode(), "rcl").nodes
    except ParameterFileError:
        assert "error" in rcl.read(file)
        return
    values = {key for name, one in nodes.items() if reads_section(name, NODE) for key in one}
    assert rcl.read(file) == {"values": dict.fromkeys(values, True)}


def section(name: str, parameters: str) -> str:
    return f"{name}:\n  ros__parameters:\n    {parameters}\n"


SPEC = """\
version: 1
name: fleet
mode: central
hub: pi
ros: {{distro: {distro}}}
hosts:
  pi: {{address: 192.168.77.11}}
robots:
  k3: {{type: khepera3, host: pi}}
links:
  - {{kind: serial, host: pi, robot: k3, usb: {{serial: AB12}}}}
programs:
  scan: {{robot: k3, package: foo, executable: bar, params: {{{params}}}}}
"""
FLAT = "angle: !degrees 90\nrange: {far: .inf}\n"
OF_ROS2 = """\
/**:
  ros__parameters: {rate: 3.5, frame: map}
/k3/scan:
  ros__parameters: {frame: laser, y: "y"}
other:
  ros__parameters: {lost: 1}
"""
#: Parameters of a spec, and what the node gets.
GIVEN = (
    ('a: "y", b: "1e5", c: nan, d: "08", axes: [x, y, z]',
     {"a": "y", "b": "1e5", "c": "nan", "d": "08", "axes": ["x", "y", "z"]}),
    ("stamp: 1234567890123456789, most: -9223372036854775808",
     {"stamp": 1234567890123456789, "most": -(1 << 63)}),
    ("mixed: [0, 0.5, 1]", {"mixed": [0.0, 0.5, 1.0]}),
    ("scan: {file: flat.yaml}", {"scan.angle": math.pi / 2, "scan.range.far": math.inf}),
    ("scan: {file: ros2.yaml}, frame: own", {"rate": 3.5, "frame": "own", "y": "y"}),
    ("FollowPath: {a.b: {c: 1}, d: {}, e: 2}", {"FollowPath.a.b.c": 1, "FollowPath.e": 2}),
)  # fmt: skip


@pytest.mark.parametrize(("params", "expected"), GIVEN, ids=[params[:12] for params, _ in GIVEN])
def test_a_node_gets_the_parameters_of_a_spec(
    rcl: Reader, tmp_path: Path, params: str, expected: Mapping[str, Any]
) -> None:
    (tmp_path / "flat.yaml").write_text(FLAT)
    (tmp_path / "ros2.yaml").write_text(OF_ROS2)
    bundle = bundle_of(tmp_path, SPEC.format(distro=rcl.distro, params=params), "pi")
    unit = text_of(bundle, "units/swarm-fleet.scan.service")
    paths = re.findall(r"--params-file /opt/swarm/fleet/current/(\S+)", unit)
    assert paths
    files = {f"/tmp/{number}.yaml": text_of(bundle, path) for number, path in enumerate(paths)}
    assert rcl.read(files) == {"values": {name: marked(value) for name, value in expected.items()}}
