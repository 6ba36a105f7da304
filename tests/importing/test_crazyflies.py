"""crazyflies.yaml of crazyswarm2, alone and beside launch files of ROS 2."""

from __future__ import annotations

import tempfile
from contextlib import suppress
from pathlib import Path

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmctl.importing.drafting import DraftError, Imported, Kind
from tests.importing.drafts import data, draft, lab, odd, vanished

FILE = "config/crazyflies.yaml"
SWARM = """
fileversion: 3
robots:
  cf1:
    enabled: true
    uri: radio://0/80/2M/E7E7E7E701
    initial_position: [1.5, -0.5, 0.0]
    type: cf21
    firmware_params:
      kalman: {pNAcc_xy: 1.0}
    reference_frame: odom
  cf2:
    enabled: false
    uri: radio://0/80/2M/E7E7E7E702
    type: cf21
robot_types:
  cf21:
    motion_capture:
      tracking: librigidbodytracker
all:
  firmware_logging:
    enabled: true
  reference_frame: world
"""
LAUNCH = """
<launch>
  <node pkg="crazyflie" exec="crazyflie_server" name="server"/>
  <node pkg="joy" exec="joy_node" name="joy"/>
</launch>
"""


def swarm(folder: Path, robots: str, **files: str) -> Imported:
    files = {name.replace("__", "."): text for name, text in files.items()}
    return draft(lab(folder, {FILE: f"robots: {{{robots}}}\n", **files}))


def flying(folder: Path, fields: str, name: str = "cf1") -> Imported:
    return swarm(folder, f"{name}: {{uri: 'radio://0/80/2M/E7E7E7E701', {fields}}}")


def test_an_enabled_robot_has_its_radio_and_its_start(tmp_path: Path) -> None:
    made = draft(lab(tmp_path, {FILE: SWARM}))
    found = data(made)
    assert found["robots"] == {
        "cf1": {"type": "crazyflie", "host": "robot-pc", "start": {"x": 1.5, "y": -0.5}}
    }
    assert found["links"] == [
        {"kind": "radio", "host": "robot-pc", "robot": "cf1", "uri": "radio://0/80/2M/E7E7E7E701"}
    ]
    assert (found["ros"], found["hosts"]) == ({"distro": "jazzy"}, {"robot-pc": {}})
    assert "# address: 192.168.77.11  # fill in: no file names a computer; write each" in made.text
    assert "guess: crazyswarm2 drives Crazyflies, and `cf21` is one of its robot_types" in made.text


def test_what_a_spec_has_no_key_for_is_not_read(tmp_path: Path) -> None:
    made = draft(lab(tmp_path, {FILE: SWARM}))
    for line in (
        "12: robot `cf2`: it is not enabled",
        "2: a spec has no key for fileversion",
        "9: a spec has no key for robots.cf1.firmware_params",
        "11: a spec has no key for robots.cf1.reference_frame",
        "17: a spec has no key for robot_types.cf21",
        "21: a spec has no key for all.firmware_logging",
        "23: a spec has no key for all.reference_frame",
    ):
        assert f"#   {FILE}:{line}\n" in made.text
    assert vanished(SWARM, FILE, made) == ["enabled: true"]  # which the robot shows


def test_it_is_one_lab_with_launch_files(tmp_path: Path) -> None:
    made = draft(lab(tmp_path, {FILE: SWARM, "swarm.launch.xml": LAUNCH, "env.sh": "ROS_DOMAIN_ID=7\n"}))
    found = data(made)
    assert list(found["hosts"]) == ["robot-pc"]
    assert (list(found["robots"]), list(found["programs"])) == (["cf1"], ["joy"])
    assert found["ros"]["domain"] == 7
    why = "crazyflie_server: the driver of each Crazyflie replaces it"
    assert f"#   swarm.launch.xml:3: {why}" in made.text


def test_one_file_may_be_named(tmp_path: Path) -> None:
    folder = lab(tmp_path, {FILE: SWARM})
    assert list(data(draft(folder / FILE))["robots"]) == ["cf1"]
    assert list(data(draft(folder, Kind.ROS_2))["robots"]) == ["cf1"]


def test_the_first_of_several_hosts_is_a_guess(tmp_path: Path) -> None:
    env = 'export ROS_DISCOVERY_SERVER="192.168.77.10:11811;192.168.77.12:11811"\n'
    made = swarm(tmp_path, "cf1: {uri: 'radio://0/80/2M'}", env__sh=env)
    assert data(made)["robots"]["cf1"]["host"] == "server-1"
    assert "host: server-1  # guess: no file names the host of their radio; this is the first" in made.text


@pytest.mark.parametrize(
    "uri", ["usb://0", "udp://10.0.0.1:19850", "radio://*/80/2M/E7E7E7E701", "radio://0/200/2M"]
)
def test_another_uri_is_to_fill_in(tmp_path: Path, uri: str) -> None:
    made = swarm(tmp_path, f"cf1: {{uri: '{uri}'}}")
    assert data(made).get("links") is None
    line = next(one for one in made.text.split("\n") if "kind: radio" in one)
    assert line.startswith("  # - {kind: radio, host: robot-pc, robot: cf1, uri: ")
    assert f"# fill in: {FILE}:1: " in line


def test_a_uri_gets_its_full_form(tmp_path: Path) -> None:
    made = swarm(tmp_path, "cf1: {uri: 'radio://0/80/2m'}")
    assert data(made)["links"][0]["uri"] == "radio://0/80/2M/E7E7E7E7E7"
    assert 'config/crazyflies.yaml:1, "radio://0/80/2m" there' in made.text


def test_a_secret_in_a_uri_is_not_copied(tmp_path: Path) -> None:
    made = swarm(tmp_path, "cf1: {uri: 'udp://me:hunter2@10.0.0.1'}")
    assert "hunter2" not in made.text
    assert f"fill in: {FILE}:1: its uri may have a secret" in made.text


@pytest.mark.parametrize(
    ("position", "start", "why"),
    [
        ("[1, 2, 0]", {"x": 1.0, "y": 2.0}, ""),
        ("[1.0, 2.0]", {"x": 1.0, "y": 2.0}, ""),
        ("[1.0, 2.0, 0.3]", {"x": 1.0, "y": 2.0}, "a robot starts at x and y, and initial_position of robot"),
        ("[1.0, high, 0.0]", None, "a spec has no key for robots.cf1.initial_position"),
        ("[1.0]", None, "a spec has no key for robots.cf1.initial_position"),
        ("here", None, "a spec has no key for robots.cf1.initial_position"),
    ],
)
def test_a_position_is_a_start(
    tmp_path: Path, position: str, start: dict[str, float] | None, why: str
) -> None:
    made = flying(tmp_path, f"initial_position: {position}")
    assert data(made)["robots"]["cf1"].get("start") == start
    assert (f"#   {FILE}:1: {why}" in made.text) if why else ("Not read" not in made.text)


@pytest.mark.parametrize(
    ("name", "key", "namespace"),
    [("cf231", "cf231", None), ("CF_A", "cf-a", "CF_A"), ("7up", "robot-7up", "7up")],
)
def test_its_topics_keep_its_name(tmp_path: Path, name: str, key: str, namespace: str | None) -> None:
    made = flying(tmp_path, "enabled: true", name)
    if namespace == "7up":  # no name of ROS begins with a digit
        assert "fill in: `namespace`" in made.text
    else:
        assert data(made)["robots"][key].get("namespace") == namespace


def test_a_robot_without_a_uri_is_named(tmp_path: Path) -> None:
    made = swarm(tmp_path, "cf1: {uri: 'radio://0/80/2M'}, cf2: {type: cf21}, cf3: 5")
    assert list(data(made)["robots"]) == ["cf1"]
    for name in ("cf2", "cf3"):
        assert f"#   {FILE}:1: robot `{name}`: it has no uri" in made.text


def test_enabled_is_true_or_false(tmp_path: Path) -> None:
    made = flying(tmp_path, "enabled: perhaps")
    assert list(data(made)["robots"]) == ["cf1"]
    assert f"#   {FILE}:1: a spec has no key for robots.cf1.enabled" in made.text


def test_robots_of_another_file_are_none(tmp_path: Path) -> None:
    with pytest.raises(DraftError, match="nothing that can be imported"):
        draft(lab(tmp_path, {"robots.yaml": "robots: {a: {type: cf21}, b: [uri]}\n"}))


WORDS = ["uri", "enabled", "type", "initial_position", "radio://0/80/2M", "usb://0", "", "a b", "cf1", "<<"]
SCALARS, ODD = odd(WORDS)
ROBOT = st.fixed_dictionaries(
    {"uri": ODD},
    optional={
        "enabled": ODD,
        "type": ODD,
        "initial_position": st.one_of(st.lists(SCALARS), ODD),
        "more": ODD,
    },
)
ROBOTS = st.dictionaries(st.text(max_size=5), st.one_of(ROBOT, ROBOT, ODD), max_size=4).map(
    lambda others: {"cf1": {"uri": "radio://0/80/2M"}, **others}
)


@settings(max_examples=60)
@given(st.fixed_dictionaries({"robots": ROBOTS}, optional={"all": ODD, "robot_types": ODD, "more": ODD}))
def test_odd_files_are_drafted_or_refused(file: object) -> None:
    text = yaml.safe_dump(file, allow_unicode=True)
    with tempfile.TemporaryDirectory() as folder, suppress(DraftError):
        assert {*vanished(text, FILE, draft(lab(Path(folder), {FILE: text})))} <= {"enabled: true"}
