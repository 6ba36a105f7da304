"""Robot types as data: what a file may say, how settings are layered, what reaches the driver."""

from __future__ import annotations

import ast
import re

import pytest
import yaml
from pydantic import ValidationError
from swarm_onboard.driver.config import parse

from swarmctl.resources import onboard, templates
from swarmctl.robot_types.any_robot_type import with_protocol
from swarmctl.robot_types.driver_params import params_of
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.ros_robot_type import RosRobotType
from swarmctl.robot_types.settings import RobotSettings, merged
from swarmctl.spec.catalog import load_catalog
from tests import ROOT
from tests.onboard.driver.fakes import TYPES, config_for, params_for, ros_name


def type_data(name: str):
    return yaml.safe_load((templates() / "robots" / f"{name}.yaml").read_text())


def test_the_catalog_has_all_robots_and_no_complaints():
    catalog = load_catalog()
    assert set(TYPES) <= set(catalog.types)
    assert all((*catalog.types.values(), *catalog.drivers.values()))  # a file with a fault raises
    assert catalog.diagnostics == ()


def test_values_in_a_link_of_the_catalog_reach_the_drivers():
    """Else two robots of one host have one port, whatever their links say."""
    uses = {"baud": {"baud", "uri"}, "port": {"link_port", "uri"}, "local_ports": {"local_port", "uri"}}
    kinds = load_catalog().types
    checked = [
        (name, key, {one for _, one in driver.placeholders} & placeholders)
        for name, kind in kinds.items()
        if isinstance(kind, RosRobotType) and kind.link is not None
        for driver in kind.drivers
        for key, placeholders in uses.items()
        if getattr(kind.link, key)
    ]
    assert ("px4", "local_ports", {"local_port"}) in checked
    assert [one for one in checked if not one[2]] == []


@pytest.mark.parametrize("type_name", TYPES)
def test_what_is_written_for_a_driver_is_what_it_reads(type_name):
    params = params_for(type_name)
    assert yaml.safe_load(yaml.safe_dump(params)) == params
    assert parse(params).robot == ros_name(type_name)


def test_special_settings_win_over_general_ones_key_by_key():
    general = RobotSettings.model_validate({"command_timeout": 0.3, "rates": {"odom": 5, "proximity": 2}})
    special = RobotSettings.model_validate({"rates": {"odom": 20}})
    assert merged(general, special) == RobotSettings.model_validate(
        {"command_timeout": 0.3, "rates": {"odom": 20, "proximity": 2}}
    )
    assert merged() == RobotSettings()


@pytest.mark.parametrize(
    "settings",
    [
        {"command_timeout": 0},
        {"command_timeout": 2.1},
        {"command_timeout": "0.5"},
        {"command_timeout": float("nan")},
        {"rates": {"diagnostics": 0}},
        {"limits": {"linear": 0}},
        {"calibration": {"wheel_separation": [8, 6]}},
        {"deadman": False},
    ],
)
def test_settings_that_make_no_sense_or_no_safety_are_refused(settings):
    with pytest.raises(ValidationError):
        RobotSettings.model_validate(settings)


@pytest.mark.parametrize(
    ("path", "value", "complaint"),
    [
        (("protocol", "set_speed", "send"), "D,{left}", "{left} and {right}"),
        (("protocol", "set_speed", "send"), "D,{left},{right}\nD,9,9", "pattern"),
        (("protocol", "queries", "proximity", "values"), 3, "has 3 values, sensor `proximity` takes 16"),
        (("protocol", "queries", "proximity", "pattern"), "([0-9]+", "not a regular expression"),
        (("protocol", "queries", "proximity", "pattern"), "([0-9]+)", "groups, one for each of `values`"),
        (("protocol", "queries", "spare"), {"send": "S", "reply": "s"}, "no sensor reads the query `spare`"),
        (("sensors", "odom", "read"), "nothing", "none of the `queries`"),
        (("sensors", "counters"), {"kind": "wheels", "read": "position"}, "are called `odom`"),
        (("sensors", "proximity", "distances"), [[5, 0.1], [3, 0.2]], "from small readings to large"),
        (("sensors", "proximity", "kind"), "radar", "does not match any of the expected tags"),
        (("actuators", "odom"), {"send": "L,{value}", "channels": ["a"], "max": 1}, "is taken"),
        (("actuators", "leds"), {"send": "L,1", "channels": ["a"], "max": 1}, "needs {value}"),
        (("actuators", "leds"), {"send": "{value:b} 00", "channels": ["a"], "max": 1}, "not written for"),
        (("settings",), {"rates": {"sonar": 1.0}}, "none of the `sensors`"),
        (("kinematics", "scales"), [], "at least 1"),
        (("kinematics", "wheel_speed_min"), 1.0, "must be below"),
        (("kinematics", "wheel_diameter"), 0.085, "Extra inputs"),
        (("sensors",), {}, "no sensor reads"),
    ],
)
def test_a_robot_type_that_does_not_hold_together_is_refused(path, value, complaint):
    data = {"actuators": {}, **type_data("koala")}
    place = data
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    with pytest.raises(ValidationError, match=complaint):
        RobotType.model_validate(data)


@pytest.mark.parametrize(
    ("path", "value", "complaint"),
    [
        (("protocol", "firmware_timeout"), None, "valid number"),
        (("protocol", "firmware_timeout"), 2.5, "less than or equal to 2"),
        (("protocol", "subscribes"), [], "`subscribes` has no `cmd_vel`"),
        (
            ("protocol", "subscribes"),
            [{"topic": "cmd_vel", "type": "std_msgs/Int32"}],
            "`subscribes` has no `cmd_vel`",
        ),
        (("protocol", "publishes", 0, "topic"), "/lwheel", "namespace"),
        (("protocol", "publishes", 0, "rate"), None, "how often"),
        (("protocol", "kind"), "line", "set_speed"),
        (("kinematics", "scales"), [{"speed_units_per_mps": 1, "metres_per_count": 1}], "m/s and rad/s"),
        (("protocol", "odometry", "left"), "cmd_vel", "`odometry` counts on `cmd_vel`"),
        (("kinematics", "wheel_radius"), None, "wheel_radius"),
        (("firmware_dead_man",), False, "dead-man"),
    ],
)
def test_a_rosserial_robot_stops_by_itself_and_takes_cmd_vel(path, value, complaint):
    data = type_data("arduino-rover")
    assert RobotType.model_validate(data).sketch is not None
    place = data
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    with pytest.raises(ValidationError, match=complaint):
        RobotType.model_validate(data)


def test_lines_of_text_need_the_robots_own_units():
    data = type_data("koala")
    del data["kinematics"]["scales"]
    with pytest.raises(ValidationError, match=r"add `kinematics\.scales`"):
        RobotType.model_validate(data)


@pytest.mark.parametrize("bounds", [(3.0, 2.0, None), (3.0, 3.0, None), (3.0,), (None, 3.0), (None, None)])
def test_scales_with_gaps_or_overlaps_are_refused(bounds):
    data = type_data("khepera3")
    scale = data["kinematics"]["scales"][-1]
    data["kinematics"]["scales"] = [scale | ({"firmware_below": bound} if bound else {}) for bound in bounds]
    with pytest.raises(ValidationError, match="old firmware to new"):
        RobotType.model_validate(data)


def test_a_larger_wheel_goes_farther_a_count_and_needs_fewer_units():
    plain, larger = config_for("koala"), config_for("koala", calibration={"distance_scale": 1.02})
    (before,), (after,) = plain.kinematics.scales, larger.kinematics.scales
    assert after.metres_per_count == pytest.approx(1.02 * before.metres_per_count)
    assert after.speed_units_per_mps == pytest.approx(before.speed_units_per_mps / 1.02)
    fastest = larger.kinematics.wheel_speed_max * after.speed_units_per_mps
    assert fastest == pytest.approx(plain.kinematics.wheel_speed_max * before.speed_units_per_mps)


def test_limits_come_down_but_never_go_up():
    assert config_for("koala", limits={"linear": 0.2}).kinematics.linear_max == 0.2
    assert config_for("koala", limits={"linear": 9.0}).kinematics.linear_max == pytest.approx(0.45)
    assert config_for("koala").kinematics.angular_max == pytest.approx(2 * 0.45 / 0.29)


def test_the_link_may_set_another_baud_rate():
    koala = with_protocol(load_catalog().types)["koala"]
    params = params_of(koala, robot="a", namespace="/a", port="/dev/x", settings=RobotSettings(), baud=38400)
    assert params["serial"]["baud"] == 38400


@pytest.mark.parametrize("file", sorted((onboard() / "driver").rglob("*.py")), ids=lambda file: file.name)
def test_drivers_are_written_for_the_python_of_ros_noetic(file):
    ast.parse(file.read_text(), feature_version=(3, 8))


def test_the_page_says_which_types_drive_on_without_a_host():
    page = (ROOT / "docs/dead-man.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (`.*`) \| (drives on|stands)", page, re.MULTILINE)
    shown = {name: words == "stands" for names, words in rows for name in re.findall(r"`([^`]+)`", names)}
    types = with_protocol(load_catalog().types)
    assert shown == {name: one.firmware_dead_man for name, one in types.items()}
