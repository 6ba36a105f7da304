"""Docker Compose files: a container for each service, and the variables of ROS that they set."""

from __future__ import annotations

import tempfile
from contextlib import suppress
from pathlib import Path

import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmctl.importing.drafting import DraftError
from tests.importing.drafts import data, draft, lab, odd

FILE = """\
x-common: &common
  network_mode: host
  restart: unless-stopped
  env_file: .env.dds
services:
  driver:
    <<: *common
    image: my/driver:humble
    privileged: true
    devices: [/dev/ttyUSB0:/dev/ttyUSB0, "/dev/video0:/dev/camera"]
    volumes:
      - /home/robot/maps:/maps:ro
      - ./params:/params
    environment:
      - SPEED=${SPEED:-0.2}
      - PORT=${PORT:?none}
      - TOKEN=hunter2
      - USER
    command: ros2 launch my_driver robot.launch.py robot_namespace:=${NAME}
  camera:
    build: camera
    environment: {RATE: 30}
    entrypoint: [bash, -c]
    command: ["ros2 run camera node"]
    cap_add: [SYS_NICE]
    runtime: nvidia
volumes: {data: {}}
"""
ENV = "NAME=panther\nRMW_IMPLEMENTATION=rmw_cyclonedds_cpp\n"


def test_each_service_is_a_container(tmp_path: Path) -> None:
    files = {"docker-compose.yml": FILE, ".env": ENV, ".env.dds": "ROS_DOMAIN_ID=30\nLOG='a b'\n"}
    made = draft(lab(tmp_path, files))
    found = data(made)
    assert found["ros"] == {"distro": "humble", "domain": 30, "rmw": "cyclonedds"}
    assert found["programs"] == {
        "driver": {"host": "robot-pc", "environment": {"ROS_DOMAIN_ID": "30", "LOG": "a b", "SPEED": "0.2"}},
        "camera": {"host": "robot-pc", "environment": {"RATE": "30"}},
    }
    for line in (
        '    # container: {image: "my/driver:humble@sha256:...", command: [ros2, launch, my_driver, robot',
        '.launch.py, "robot_namespace:=panther"], devices: [/dev/ttyUSB0, /dev/video0], volumes: [',
        '"/home/robot/maps:/maps:ro"], privileged: true}  # fill in: the digest of its image, as `docker',
        '# container: {image: "camera@sha256:...", command: [bash, "-c", ros2 run camera node]}  # fill in: ',
        "#   docker-compose.yml:10: the device /dev/video0 is /dev/camera in the container",
        "#   docker-compose.yml:13: the volume ./params:/params of `driver` is no folder of the host",
        "#   docker-compose.yml:15: ${SPEED:-0.2} of `driver`; here its variable is not set",
        "#   docker-compose.yml:16: a value of `driver` depends on the variable ${PORT:?none}",
        "#   docker-compose.yml:17: TOKEN of `driver` may be a secret",
        "#   docker-compose.yml:18: USER of `driver` is not known here",
        "#   docker-compose.yml:21: build (camera) of the container `camera` has no key in a spec",
        "#   docker-compose.yml:25: cap_add of the container `camera` has no key in a spec",
        "#   docker-compose.yml:26: runtime (nvidia) of the container `camera` has no key in a spec",
        "#   docker-compose.yml:27: a spec has no key for the volumes of a Compose file",
    ):
        assert line in made.text
    assert "hunter2" not in made.text


def test_one_file_is_read_with_its_variables(tmp_path: Path) -> None:
    folder = lab(tmp_path, {"compose.yaml": FILE, ".env.dds": ENV, "other.launch": "<launch/>"})
    programs = data(draft(folder / "compose.yaml"))["programs"]
    assert programs["driver"]["environment"]["RMW_IMPLEMENTATION"] == "rmw_cyclonedds_cpp"


def test_a_container_with_the_driver_of_a_type_is_its_robot(tmp_path: Path) -> None:
    text = """\
services:
  robot:
    image: ros:jazzy
    environment: [TURTLEBOT3_MODEL=burger]
    command: bash -c "source /ws/setup.bash && ros2 launch turtlebot3_bringup robot.launch.py namespace:=tb_1"
"""
    made = draft(lab(tmp_path, {"compose.yaml": text}))
    found = data(made)
    assert (found["ros"]["distro"], found["robots"]["tb-1"]["type"]) == ("jazzy", "turtlebot3-burger")
    assert "programs" not in found
    assert (
        "#   compose.yaml:2: the container `robot`; the driver of its robot's type runs without one"
        in made.text
    )


def test_containers_of_ros_1_are_a_draft_of_ros_1(tmp_path: Path) -> None:
    text = """\
services:
  camera:
    image: ros:noetic
    environment: {ROS_MASTER_URI: "http://10.0.0.5:11311", ROS_IP: 10.0.0.7}
    command: roslaunch camera all.launch
"""
    found = data(draft(lab(tmp_path, {"compose.yaml": text})))
    assert [one["address"] for one in found["hosts"].values()] == ["10.0.0.7", "10.0.0.5"]
    assert list(found["programs"]) == ["camera"]


def test_a_variable_of_one_container_is_not_that_of_the_swarm(tmp_path: Path) -> None:
    text = """\
services:
  router: {image: "r:1", environment: {ROS_LOCALHOST_ONLY: 1, ROS_DOMAIN_ID: 4}}
  camera: {image: "c:1", environment: {ROS_DOMAIN_ID: 4}}
"""
    found = data(draft(lab(tmp_path, {"compose.yaml": text})))
    assert found["ros"] == {"distro": "jazzy", "domain": 4}
    assert found["programs"]["router"]["environment"] == {"ROS_LOCALHOST_ONLY": "1"}


WORDS = [
    *("image", "command", "environment", "env_file", "devices", "volumes", "path", "extends", "<<", "a:b"),
    *("ROS_DOMAIN_ID=7", "${A:-b}", "${", "$$", "'", "/dev/x:/dev/y:rwm", "/a:/b", "ros2 launch p f.py"),
]
_, ODD = odd(WORDS)
SERVICE = st.dictionaries(st.sampled_from(WORDS), ODD, max_size=6).map(lambda one: {"image": "i", **one})


@settings(max_examples=60)
@given(st.dictionaries(st.text(max_size=4), SERVICE, min_size=1, max_size=3), ODD)
def test_odd_files_are_drafted_or_refused(services: object, more: object) -> None:
    text = yaml.safe_dump({"services": services, "volumes": more})
    with tempfile.TemporaryDirectory() as folder, suppress(DraftError):
        draft(lab(Path(folder), {"compose.yaml": text, ".env": "A=1\n"}))


def test_a_variable_that_the_swarm_has_otherwise_stays(tmp_path: Path) -> None:
    service = "services:\n  {0}: {{image: ros, command: ros2 run p e, environment: [ROS_DOMAIN_ID={1}]}}\n"
    files = {"a/compose.yaml": service.format("one", 4), "b/compose.yaml": service.format("two", 5)}
    made = draft(lab(tmp_path, files))
    found = data(made)
    assert found["ros"]["domain"] == 4
    assert "environment" not in found["programs"]["one"]
    assert found["programs"]["two"]["environment"] == {"ROS_DOMAIN_ID": "5"}
    assert "#   b/compose.yaml:2: ROS_DOMAIN_ID has another value than in a/compose.yaml:2" in made.text


def test_a_file_of_the_folder_is_delivered_to_its_container(tmp_path: Path) -> None:
    compose = """\
services:
  nav:
    image: ros
    volumes: [./config/nav2.yaml:/params.yaml:ro, ./config/nav2.yaml:/etc/a.yaml, ./maps:/maps]
    command: ros2 launch nav2_bringup navigation_launch.py params_file:=/params.yaml
"""
    files = {"docker/compose.yaml": compose, "docker/config/nav2.yaml": "a: {ros__parameters: {x: 1}}\n"}
    made = draft(lab(tmp_path, files))
    nav = data(made)["programs"]["nav"]
    assert nav["files"] == {"nav2.yaml": "docker/config/nav2.yaml"}
    assert '"params_file:={files}/nav2.yaml"' in made.text
    assert "volume ./maps:/maps of `nav` is no folder" in made.text
    assert "config/nav2.yaml is at /etc/a.yaml in `nav`, which only its image knows" in made.text
    assert "nav2.yaml: parameter file" not in made.text
