"""What a driver node publishes and subscribes to, as a process with a robot at its line."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
import yaml
from swarm_onboard.ros2.parameters import flat

from swarmctl.robot_types.any_robot_type import with_protocol
from swarmctl.robot_types.settings import RobotSettings
from swarmctl.spec.catalog import load_catalog
from swarmctl.swarm.topics import actuators_of, driver_topics
from tests.onboard.driver.driver_process import Node, running, wired
from tests.onboard.driver.fakes import TYPES, config_for, ros_name
from tests.timing import PATIENCE, wait_for

pytestmark = pytest.mark.usefixtures("ros")

CATALOG = with_protocol(load_catalog().types)
OWN = ("listening", "shutdown", "subscribes", "parameter")  # what the fake ROS itself reports


def topics_of(node: Node) -> set[str]:
    return {message["topic"] for message in list(node.published)} - set(OWN)


def all_on(type_name: str) -> dict[str, float]:
    """Everything that the robot senses, as often as a line bears all of it at once."""
    return {one.name: 2.0 for one in config_for(type_name).sensors}


@pytest.mark.parametrize("type_name", TYPES)
def test_the_graph_is_the_one_that_is_expected_of_the_type(type_name, tmp_path):
    settings = RobotSettings.model_validate({"rates": all_on(type_name)})
    expected = driver_topics(CATALOG[type_name], settings)
    placed = ["/tf_static"] if any(one.kind == "range" for one in CATALOG[type_name].sensors.values()) else []
    topics = {"/tf", *placed, *(one.name for one in expected)}
    with wired(type_name, tmp_path, rates=all_on(type_name)) as wiring, running(wiring.config) as node:
        wait_for(lambda: topics <= topics_of(node))
        assert topics_of(node) == topics


@pytest.mark.parametrize("type_name", TYPES)
def test_every_frame_and_every_topic_is_the_robots_own(type_name, tmp_path):
    """Two robots on one master have nothing in common but the topics at the top of the graph."""
    with wired(type_name, tmp_path, rates=all_on(type_name)) as wiring, running(wiring.config) as node:
        node.wait_until_ready()
        wait_for(lambda: "joint_states" in topics_of(node))
        prefix = f"{ros_name(type_name)}/"
        assert {one for one in topics_of(node) if one.startswith("/")} <= {
            "/tf",
            "/tf_static",
            "/diagnostics",
        }
        for message in [one for one in list(node.published) if one["topic"] not in OWN]:
            frames = [message.get("header", {}).get("frame_id"), message.get("child_frame_id")]
            for transform in message.get("transforms", []):
                frames += [transform["header"]["frame_id"], transform["child_frame_id"]]
            assert all(one.startswith(prefix) for one in frames if isinstance(one, str)), message


def test_the_sensors_of_an_e_puck2_are_messages_in_si_units(tmp_path):
    with wired("epuck2", tmp_path, rates={"temperature": 5}) as wiring, running(wiring.config) as node:
        node.wait_until_ready()
        names = ("imu", "magnetic", "battery", "temperature", "tof/front", "microphones", "joint_states")
        wait_for(lambda: set(names) <= topics_of(node))
        imu, magnetic, battery, temperature, tof, microphones, _ = (node.latest(name) for name in names)
        assert imu["linear_acceleration"]["z"] == pytest.approx(9.81, abs=0.05)
        assert imu["orientation_covariance"][0] == -1.0
        assert "linear_acceleration_covariance" not in imu, "as the message comes: all zero, unknown"
        assert abs(magnetic["magnetic_field"]["z"]) < 1e-4
        assert (battery["present"], 3.4 < battery["voltage"] < 4.2) == (True, True)
        assert math.isnan(battery["current"])
        assert temperature["temperature"] == 31.0
        assert (tof["range"], tof["min_range"], tof["max_range"]) == (math.inf, 0.02, 2.0)
        assert microphones["layout"]["dim"][0]["label"] == "m0,m1,m2,m3"


@pytest.mark.parametrize(
    ("camera", "encoding", "step"), [({}, "mono8", 40), ({"encoding": "rgb565", "height": 30}, "rgb8", 120)]
)
def test_an_image_is_as_large_as_it_says(camera, encoding, step, tmp_path):
    with (
        wired("epuck-binary", tmp_path, rates={"camera": 4}, camera=camera) as wiring,
        running(wiring.config) as node,
    ):
        info = wait_for(lambda: node.latest("camera/camera_info"))
        image = next(
            one for one in list(node.published)
            if one["topic"] == "camera/image_raw" and one["header"]["stamp"] == info["header"]["stamp"]
        )  # fmt: skip
        height = camera.get("height", 40)
        assert (image["encoding"], image["width"], image["height"]) == (encoding, 40, height)
        assert (image["step"], len(image["data"])) == (step, step * height)
        assert (info["width"], info["height"]) == (40, height)
        assert image["header"]["frame_id"] == info["header"]["frame_id"] == "epuck_binary/camera_optical"
        if encoding == "mono8":  # the emulator's images are a gradient
            assert {(after - before) % 256 for before, after in pairwise(image["data"])} == {1}


def test_a_gyroscope_alone_says_that_it_measures_no_acceleration(tmp_path):
    with wired("epuck", tmp_path, rates={"gyroscope": 5}) as wiring, running(wiring.config) as node:
        message = wait_for(lambda: node.latest("gyroscope"))
        assert message["linear_acceleration_covariance"][0] == -1.0
        assert "angular_velocity_covariance" not in message


def test_joints_turn_as_far_as_the_wheels_do(tmp_path):
    with wired("koala", tmp_path) as wiring, running(wiring.config) as node:
        node.wait_until_ready()
        node.drive(1.0, 0.1, 0.3)
        wait_for(lambda: not wiring.moving())
        node.published.clear()
        joints = wait_for(lambda: node.latest("joint_states"))
        assert joints["name"] == ["left_wheel", "right_wheel"]
        truth = wiring.pty.robot.chassis
        ways = [wheel.count * 4.5e-5 / 0.0425 for wheel in (truth.left, truth.right)]
        assert joints["position"] == pytest.approx(ways, abs=0.02)
        wait_for(lambda: node.latest("joint_states")["velocity"] == [0.0, 0.0])


def test_the_messages_of_one_reading_have_one_stamp(tmp_path):
    with wired("koala", tmp_path) as wiring, running(wiring.config) as node:
        node.wait_until_ready()
        wait_for(lambda: sum(one["topic"] == "joint_states" for one in list(node.published)) > 3)
        stamps: dict[str, set[float]] = {}
        for message in list(node.published):
            header = (
                message["transforms"][0]["header"] if message["topic"] == "/tf" else message.get("header", {})
            )
            stamps.setdefault(message["topic"], set()).add(header.get("stamp"))
        assert stamps["joint_states"] <= stamps["/tf"] <= stamps["odom"]
        assert len(stamps["odom"]) > 2
        assert stamps["proximity/L1"] & stamps["proximity/R3"] & stamps["proximity/scan"]


def test_each_sensor_has_its_place_on_the_robot(tmp_path):
    with wired("koala", tmp_path) as wiring, running(wiring.config) as node:
        node.wait_until_ready()
        places = {one["child_frame_id"]: one for one in node.latest("/tf_static")["transforms"]}
        assert len(places) == 16
        left = places["koala/proximity_L4"]["transform"]
        assert left["translation"] == {"x": 0.055, "y": 0.14, "z": 0.0}
        assert left["rotation"] == {"x": 0.0, "y": 0.0, "z": pytest.approx(0.7071, abs=1e-4),
                                    "w": pytest.approx(0.7071, abs=1e-4)}  # fmt: skip
        wait_for(lambda: node.latest("proximity/L4"))
        assert node.latest("proximity/L4")["header"]["frame_id"] == "koala/proximity_L4"


def test_single_distances_are_made_only_where_somebody_listens(tmp_path):
    with wired("koala", tmp_path) as wiring, running(wiring.config, FAKE_LISTENERS="0") as node:
        node.wait_until_ready()
        wait_for(lambda: sum(one["topic"] == "proximity" for one in list(node.published)) > 3)
        assert not [one for one in topics_of(node) if one.startswith("proximity/")]


def test_a_robot_drives_without_sensor_messages_and_reports_it(tmp_path):
    with wired("epuck2", tmp_path) as wiring, running(wiring.config, FAKE_LACKS="sensor_msgs") as node:
        node.wait_until_ready()
        wait_for(lambda: {"proximity", "microphones", "/tf_static", "/diagnostics"} <= topics_of(node))
        node.drive(0.5, 0.1)
        node.drive_until(wiring.moving, 0.1)
        assert "this host lacks sensor_msgs" in node.status()["message"]
        assert "imu" in node.values()["left out"]
        assert not topics_of(node) & {"imu", "joint_states", "battery", "tof/front"}


def test_a_host_without_transforms_has_odometry(tmp_path):
    with wired("koala", tmp_path) as wiring, running(wiring.config, FAKE_LACKS="tf2_msgs") as node:
        node.wait_until_ready()
        wait_for(lambda: {"odom", "proximity/L0", "/diagnostics"} <= topics_of(node))
        assert not topics_of(node) & {"/tf", "/tf_static"}
        assert node.values()["left out"] == "no transforms: this host lacks tf2_msgs"
        wait_for(lambda: node.status()["level"] == 0)  # a busy machine publishes too slowly at first


def test_a_start_that_cannot_be_published_is_a_warning(tmp_path):
    with wired("koala", tmp_path) as wiring:
        params = yaml.safe_load(wiring.config.read_text())
        start = {"x": 1.0, "y": 0.0, "heading_deg": 90.0}
        wiring.config.write_text(yaml.safe_dump({**params, "start": start}))
        with running(wiring.config, FAKE_LACKS="tf2_msgs") as node:
            wait_for(lambda: node.status()["level"] == 1)
            lost = "no transforms, nor the one from map to its start: this host lacks tf2_msgs"
            assert node.status()["message"].endswith(lost)


def test_lights_and_sounds_are_set_by_their_topics(tmp_path):
    assert actuators_of(CATALOG["epuck"])["leds"] == "std_msgs/UInt8MultiArray"
    assert actuators_of(CATALOG["epuck"])["sound"] == "std_msgs/UInt8"
    with wired("epuck", tmp_path) as wiring, running(wiring.config) as node:
        node.wait_until_ready()
        node.set("leds", 1, 0, 0, 1, 0, 0, 0, 0)
        node.set("body_light", 1)
        node.set("sound", 2)
        lit = {"led0": 1, "led3": 1, "body": 1}
        wait_for(lambda: {name: on for name, on in wiring.pty.snapshot().lights.items() if on} == lit)
        wait_for(lambda: wiring.pty.snapshot().sound == 2)
        node.set("sound", 1, sender="/stranger@192.168.77.12")
        node.set("leds", 1, 1)
        wait_for(lambda: node.latest("/diagnostics"))
        wait_for(lambda: node.values().get("refused settings") == "1")
        wait_for(lambda: node.values()["refused nodes"].startswith("/stranger"))
        assert wiring.pty.snapshot().sound == 2, "only a commander sets it"
        node.process.terminate()
        assert node.process.wait(PATIENCE) == 0
        assert wiring.pty.snapshot().lights["led3"] == 1, "lights stay when the driver ends"


def test_diagnostics_report_port_firmware_rates_and_faults(tmp_path):
    with wired("khepera3", tmp_path) as wiring, running(wiring.config) as node:
        node.wait_until_ready()
        wait_for(lambda: node.status()["level"] is not None and "odom rate" in node.values())
        values = node.values()
        assert values["port"] == str(wiring.device)
        assert (values["baud"], values["firmware"], values["state"]) == ("115200", "2,1", "ready")
        assert {f"{name} rate" for name in ("odom", "proximity", "ground", "battery")} <= set(values)
        assert {"failed exchanges", "noise lines", "dead-man trips", "last error"} <= set(values)


def test_a_wrong_selector_is_reported_with_the_needed_position(tmp_path):
    with wired("epuck", tmp_path) as wiring, running(wiring.config) as node:
        node.wait_until_ready()
        with wiring.pty.now() as robot:
            robot.selector = 5
        selector = "turn the selector to 3 (Bluetooth) or 10 (second serial line)"
        expected = f"the robot reports `Selector pos 5`: {selector}"

        def reported():  # what comes while the driver clears the line, or waits to connect again, is lost
            wiring.pty.power_cycle()
            return expected in node.status()["message"] and node.values().get("the robot reports")

        assert expected in wait_for(reported, interval=0.3)
        with wiring.pty.now() as robot:
            robot.selector = 3
        wiring.pty.power_cycle()
        wait_for(lambda: node.status()["level"] == 0)
        assert "the robot reports" not in node.values()


def test_what_the_driver_works_with_stands_in_ros_parameters(tmp_path, ros):
    with wired("koala", tmp_path, limits={"linear": 0.2}, rates={"proximity": 4.0}) as wiring:
        (tmp_path / "koala.urdf").write_text("<robot name='koala'/>")
        with wiring.config.open("a") as file:
            file.write("urdf: koala.urdf\n")
        with running(wiring.config) as node:
            node.wait_until_ready()
            wait_for(lambda: "<robot name='koala'/>" in str(node.published))
            shown = {one["name"]: one["value"] for one in list(node.published) if one["topic"] == "parameter"}
            description = node.latest("robot_description")
    assert (description or {}).get("data", shown.get("robot_description")) == "<robot name='koala'/>"
    mine = shown if ros == "2" else dict(flat(shown["/driver"]))
    assert (mine["limits.linear"], mine["rates.proximity"], mine["baud"]) == (0.2, 4.0, 115200)
    assert (mine["frames.odom"], mine["frames.base"]) == ("koala/odom", "koala/base_link")
    assert mine["commanders.tester"] == 0


def test_a_robot_without_its_urdf_drives_and_reports_it(tmp_path):
    with wired("koala", tmp_path) as wiring:
        with wiring.config.open("a") as file:
            file.write("urdf: none.urdf\n")
        with running(wiring.config) as node:
            node.wait_until_ready()
            node.drive(0.5, 0.1)
            node.drive_until(wiring.moving, 0.1)
            wait_for(lambda: "no robot_description: " in node.status()["message"])


def test_the_start_of_a_robot_joins_its_odometry_to_the_map(tmp_path):
    with wired("koala", tmp_path) as wiring:
        with wiring.config.open("a") as file:
            file.write("start: {x: 0.5, y: -1.0, heading_deg: 90.0}\n")
        with running(wiring.config) as node:
            node.wait_until_ready()
            found = [one for one in list(node.published) if one["topic"] == "/tf_static"]
    assert len(found) == 1, "a latched topic keeps the last message only"
    [start] = [one for one in found[0]["transforms"] if one["child_frame_id"] == "koala/odom"]
    assert start["header"]["frame_id"] == "map"
    assert start["transform"]["translation"] == {"x": 0.5, "y": -1.0, "z": 0.0}
    assert start["transform"]["rotation"]["z"] == pytest.approx(math.sqrt(0.5))


def test_a_camera_looks_ahead_along_z_of_its_optical_frame(tmp_path):
    with wired("epuck-binary", tmp_path, rates={"camera": 4}) as wiring, running(wiring.config) as node:
        node.wait_until_ready()
        [place] = [
            one
            for one in node.latest("/tf_static")["transforms"]
            if one["child_frame_id"].endswith("optical")
        ]
    assert place["header"]["frame_id"] == "epuck_binary/base_link"
    assert place["transform"]["translation"] == {"x": 0.03, "y": 0.0, "z": 0.008}
    x, y, z, w = (place["transform"]["rotation"][key] for key in "xyzw")
    ahead = (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y))  # where its z axis points
    right = (1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y))  # and its x axis
    assert (ahead, right) == ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0))


def test_distances_around_a_robot_are_a_scan(tmp_path):
    with wired("koala", tmp_path) as wiring, running(wiring.config) as node:
        scan = wait_for(lambda: node.latest("proximity/scan"))
    assert scan["header"]["frame_id"] == "koala/base_link"
    assert len(scan["ranges"]) == 72
    assert scan["angle_min"] + 71 * scan["angle_increment"] == pytest.approx(scan["angle_max"])
    assert not [one for one in scan["ranges"] if one < scan["range_min"]]
    assert scan["scan_time"] == pytest.approx(0.2)
