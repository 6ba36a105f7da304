"""The defects of the first paper's drivers (pktehgm/newswarm), each shown to be impossible here.

D1 to D11 as they were found by reading that code; it is quoted where it matters.
"""

from __future__ import annotations

import re
import struct

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError
from swarm_onboard.driver.kinematics import wheel_units
from swarm_onboard.driver.polled_robot import linked
from swarm_onboard.driver.tally import Tally

from swarmctl.resources import onboard, templates
from swarmctl.robot_types.any_robot_type import with_protocol
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.spec.catalog import load_catalog
from swarmctl.swarm.topics import actuators_of, driver_topics
from tests.onboard.driver.fakes import TYPES, Bench, config_for, params_for

ONBOARD = onboard()


def data_of(name: str) -> dict:
    return yaml.safe_load((templates() / "robots" / f"{name}.yaml").read_text("utf-8"))


@pytest.mark.parametrize("separation", ["8,6", [8, 6], "0.086", None])
def test_d1_a_separation_of_8_comma_6_is_refused(separation):
    """`#define WHEEL_SEPARATION 8,6` made half of it 3.0 by the comma operator."""
    data = data_of("epuck")
    data["kinematics"]["wheel_separation"] = separation
    with pytest.raises(ValidationError):
        RobotType.model_validate(data)


@pytest.mark.parametrize("type_name", TYPES)
@given(linear=st.floats(-100, 100), angular=st.floats(-100, 100))
def test_d2_both_wheels_have_one_limit_on_both_sides(type_name, linear, angular):
    """The right wheel's overflow was set to 100 instead of 35 000: too fast became a spin."""
    kinematics = config_for(type_name).kinematics
    scale = kinematics.scales[0]
    left, right = wheel_units(linear, angular, kinematics, scale)
    assert (right, left) == wheel_units(linear, -angular, kinematics, scale)
    assert (-left, -right) == wheel_units(-linear, -angular, kinematics, scale)


@pytest.mark.parametrize("type_name", TYPES)
def test_d3_the_longest_command_fits(type_name):
    """`char sercmd[12]` held no `D,-100,-100\\n` with its end."""
    config = config_for(type_name)
    codec = linked(None, config.protocol, Tally()).codec
    for scale in config.kinematics.scales:
        fastest = -round(config.kinematics.wheel_speed_max * scale.speed_units_per_mps)
        sent = codec.speed(fastest, fastest).data
        assert sent.count(str(fastest).encode()) == 2 or struct.unpack("<2h", sent[1:5]) == (fastest, fastest)


@pytest.mark.parametrize("type_name", TYPES)
def test_d4_a_metre_a_second_is_one_metre_a_second(type_name):
    """Centimetres and private gains: 0.2 m/s made the Koala crawl at 18 mm/s."""
    kinematics = config_for(type_name).kinematics
    for scale in kinematics.scales:
        units = wheel_units(0.1, 0.0, kinematics, scale)
        assert units[0] / scale.speed_units_per_mps == pytest.approx(0.1, rel=0.02)


@pytest.mark.parametrize("type_name", sorted(with_protocol(load_catalog().types)))
def test_d5_diagnostics_is_the_only_topic_at_the_top(type_name):
    """All robots shared `/robot_motors`, and two e-pucks had one node name."""
    robot_type = with_protocol(load_catalog().types)[type_name]
    topics = [one.name for one in driver_topics(robot_type, robot_type.settings)]
    assert [one for one in (*topics, *actuators_of(robot_type)) if one.startswith("/")] == ["/diagnostics"]
    for file in (ONBOARD / "driver").glob("ros*.py"):
        names = re.findall(r'(?:Publisher|Subscriber)\(\s*f?"(/[^"]+)"', file.read_text("utf-8"))
        assert set(names) <= {"/diagnostics", "/tf", "/tf_static"}, file.name


def test_d6_a_driver_has_one_line():
    """One process wrote the same command to rfcomm1 to rfcomm5."""
    assert isinstance(params_for("epuck", "/dev/rfcomm3")["port"], str)


def test_d7_a_missing_port_is_reported_and_retried():
    """The port was opened before main(); a missing one ended the program without a word."""
    bench = Bench()
    bench.robot.plugged = False
    bench.run(10.0)
    assert "missing" in bench.sink.reports[-1].message
    assert len(bench.robot.tried) >= 3
    bench.robot.plugged = True
    bench.run(6.0)
    assert bench.sink.reports[-1].values["state"] == "ready"


def test_d8_the_last_command_is_not_repeated_for_ever():
    """It was, ten times a second, until somebody pulled the battery."""
    bench = Bench()
    bench.run(1.0)
    bench.command(0.1)
    bench.run(2.5)
    assert bench.robot.speed == (0, 0)
    assert bench.sink.reports[-1].values["dead-man trips"] == "1"


def test_d9_each_setting_is_in_one_place():
    """The paper's listing and the code had different topics and rates: here the type's file says both."""
    written, data = params_for("koala"), data_of("koala")
    assert written["protocol"]["set_speed"]["send"] == data["protocol"]["set_speed"]["send"]
    assert set(written["sensors"]) == set(data["sensors"])


def test_d10_every_reply_is_read_and_every_sensor_published():
    """Replies were never read; they piled up in the port until it was full."""
    bench = Bench()
    bench.run(5.0)
    assert bench.robot.waiting == b""
    assert {name for name, _ in bench.sink.readings} == {"proximity", "battery"}


def test_d11_no_publisher_keeps_old_commands():
    """A publisher without a queue size blocks or piles up; commands here are one mailbox of one."""
    for file in ONBOARD.rglob("*.py"):
        text = file.read_text("utf-8")
        for made in re.findall(r"rospy\.(?:Publisher|Subscriber)\((?:[^()]|\([^()]*\))*\)", text):
            assert "queue_size=" in made, f"{file.name}: {made}"
    bench = Bench()
    bench.run(1.0)
    for step in range(50):
        bench.command(step / 1000)
    bench.run(0.1)
    assert [one for one in bench.robot.speed_requests() if one != "D,0,0"] == ["D,11,11"]
