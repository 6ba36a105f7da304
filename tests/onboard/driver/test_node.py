"""The driver node against emulated robots, which know the manuals but not the robot type files."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import threading
import time

import pytest
import yaml
from swarm_onboard.common.systemd import REJOINS
from swarm_onboard.driver.port import Port, PortError

from swarmctl.lab.emulators.serial_faults import Faults
from tests.onboard.driver.driver_process import DRIVERS, PYTHONPATH, master, no_master, running, wired
from tests.onboard.driver.fakes import TESTER, TYPES, config_for, ros_name
from tests.onboard.multimaster.masters import Rosmaster, served
from tests.timing import PATIENCE, RunQueue, wait_for

TAKES_BACK_EVERY = 5.0  # s at least, as ros1/registration.py has it
BOTH = pytest.mark.usefixtures("ros")  # ROS 1 and ROS 2


@pytest.mark.parametrize("type_name", TYPES)
@BOTH
def test_a_robot_drives_as_ordered_and_knows_where_it_is(type_name, tmp_path):
    with wired(type_name, tmp_path) as wiring, running(wiring.config) as node:
        node.wait_until_ready()
        node.drive(1.0, 0.1, 0.5)
        driving = wiring.pty.snapshot()
        assert (driving.v, driving.omega) == pytest.approx((0.1, 0.5), rel=0.02)
        wait_for(lambda: not wiring.moving())
        node.published.clear()
        odom = wait_for(lambda: node.latest("odom"))
        truth, place = wiring.pty.snapshot(), odom["pose"]["pose"]["position"]
        assert (place["x"], place["y"]) == pytest.approx((truth.x, truth.y), abs=0.002)
        assert odom["header"]["frame_id"] == f"{ros_name(type_name)}/odom"


@pytest.mark.parametrize("type_name", TYPES)
@BOTH
def test_a_robot_stops_when_its_commands_stop(type_name, tmp_path, promise):
    """After half a second, and 0.1 for the line."""
    with wired(type_name, tmp_path) as wiring, running(wiring.config) as node:
        node.wait_until_ready()
        node.drive(0.5, 0.1)
        queue, last, way = RunQueue(node.process.pid), time.monotonic(), wiring.pty.snapshot().distance
        node.command(0.1)
        wait_for(lambda: wiring.pty.snapshot().distance - way >= 0.45 * 0.1)
        wait_for(lambda: not wiring.moving())
        took = time.monotonic() - last
        promise(f"commands end, until the {type_name} stands", took - queue.lost(), 0.6)


@BOTH
def test_a_stamped_command_counts_by_its_stamp(tmp_path):
    with wired("koala", tmp_path) as wiring:
        params = yaml.safe_load(wiring.config.read_text())
        wiring.config.write_text(yaml.safe_dump({**params, "command_type": "geometry_msgs/TwistStamped"}))
        with running(wiring.config) as node:
            node.wait_until_ready()
            complaint = "refuses /tester on 192.168.77.10: its command was 5.0 s old by its stamp"
            if os.environ["ROS_VERSION"] == "2":
                complaint = complaint.replace(" on 192.168.77.10", "")

            def reported() -> bool:
                node.command(0.1)  # of another type
                node.command(0.1, stamp=time.time() - 5)
                return complaint in node.status()["message"]

            wait_for(reported)
            assert wiring.pty.snapshot().distance == 0
            wait_for(lambda: node.command(0.1, stamp=time.time()) or wiring.moving())


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
@BOTH
def test_a_signal_ends_the_node_with_a_stop(number, tmp_path):
    with wired("koala", tmp_path, command_timeout=2.0) as wiring, running(wiring.config) as node:
        node.wait_until_ready()
        node.drive(0.3, 0.1)
        node.process.send_signal(number)
        assert node.process.wait(PATIENCE) == 0
        assert not wiring.moving()
        assert wiring.pty.snapshot().last_command == "D,0,0"


def test_a_node_that_anybody_shuts_down_drives_on(tmp_path):
    with wired("koala", tmp_path) as wiring, running(wiring.config) as node:
        node.wait_until_ready()
        node.suffer("shutdown")
        with pytest.raises(subprocess.TimeoutExpired):
            node.process.wait(3)
        node.drive_until(wiring.moving, 0.1)


def test_a_node_takes_its_name_back_seldom_and_drives_on(tmp_path):
    ros = Rosmaster()
    ros.registerPublisher("/driver", "/odom", "nav_msgs/Odometry", "http://here:1/")
    ros.registerPublisher("/boss", "/cmd_vel", "geometry_msgs/Twist", "http://boss:1/")

    def take(uri: str) -> bool:
        """Again and again, as a node of the same name that does not give up either."""
        ros.registerPublisher("/driver", "/odom", "nav_msgs/Odometry", uri)
        return len([one for one in ros.shut_down if one == ("/driver", uri)]) == 2

    with (
        wired("koala", tmp_path) as wiring,
        served(ros) as uri,
        running(wiring.config, ROS_MASTER_URI=uri) as node,
    ):
        node.wait_until_ready()
        began = time.monotonic()
        wait_for(lambda: take("http://thief:1/"), interval=0.05)
        assert time.monotonic() - began > TAKES_BACK_EVERY
        assert ros.services == {"/driver/get_loggers": "rosrpc://127.0.0.1:4712"}
        wait_for(lambda: node.latest("connects"))
        assert node.latest("connects") == {"topic": "connects", "name": "/cmd_vel", "to": ["http://boss:1/"]}
        del ros.nodes["/driver"]
        wait_for(lambda: "/driver" in ros.nodes)
        assert ros.nodes["/driver"].uri == "http://here:1/"
        assert ros.nodes["/driver"].subscribes == {"/cmd_vel"}
        node.drive_until(wiring.moving, 0.1)


def test_a_node_in_which_ros_fails_stops_its_robot_and_restarts(tmp_path):
    with wired("koala", tmp_path, command_timeout=2.0) as wiring, running(wiring.config) as node:
        node.wait_until_ready()
        node.drive(0.3, 0.1)
        node.suffer("failure")
        assert node.process.wait(PATIENCE) == os.EX_TEMPFAIL, "status 0 is for a stop"
        assert not wiring.moving()


def test_a_node_whose_master_is_away_stops_its_robot_and_can_be_ended(tmp_path):
    with wired("koala", tmp_path) as wiring:
        wiring.pty.robot.receive(b"D,50,50\n")
        with running(wiring.config, FAKE_MASTER="away") as node:
            wait_for(lambda: not wiring.moving())
            node.process.terminate()
            assert node.process.wait(PATIENCE) == 0


def test_a_node_that_the_master_forgot_stops_its_robot_and_ends(tmp_path):
    with (
        wired("koala", tmp_path, command_timeout=2.0) as wiring,
        master({}) as uri,
        running(wiring.config, ROS_MASTER_URI=uri) as node,
    ):
        node.wait_until_ready()
        node.command(0.1)
        wait_for(wiring.moving)
        assert node.process.wait(PATIENCE) == REJOINS
        assert not wiring.moving()


def test_a_node_goes_on_when_another_server_replaces_its_master(tmp_path):
    with (
        wired("koala", tmp_path) as wiring,
        no_master() as uri,
        running(wiring.config, ROS_MASTER_URI=uri) as node,
    ):
        node.wait_until_ready()
        with pytest.raises(subprocess.TimeoutExpired):
            node.process.wait(3)

        def drives() -> bool:
            node.command(0.1)
            return wiring.moving()

        wait_for(drives, interval=0.05)
        assert node.process.poll() is None


@pytest.mark.parametrize("type_name", TYPES)
@BOTH
def test_a_robot_whose_driver_was_killed_is_stopped_from_outside(type_name, tmp_path):
    with wired(type_name, tmp_path) as wiring, running(wiring.config) as node:
        node.wait_until_ready()
        node.drive_until(wiring.moving, 0.1)
        node.process.kill()
        node.process.wait()
        assert wiring.moving()
        stopped = wiring.stop_motors()
        assert (stopped.returncode, stopped.stdout) == (0, f"{ros_name(type_name)} confirmed the stop\n")
        assert not wiring.moving()


@BOTH
def test_a_cable_pulled_and_put_back_leaves_the_robot_standing(tmp_path):
    with wired("epuck", tmp_path) as wiring, running(wiring.config) as node:
        node.wait_until_ready()
        node.drive(0.3, 0.1)
        wiring.unplug()
        wait_for(lambda: node.status()["level"] == 2 and "device is missing" in node.status()["message"])
        node.command(0.1)
        wiring.plug()
        wait_for(lambda: not wiring.moving())
        wait_for(lambda: node.status()["level"] == 0)
        assert wiring.pty.snapshot().left == 0
        assert node.process.poll() is None
        node.drive(0.3, 0.1)
        node.drive_until(wiring.moving, 0.1)


@BOTH
def test_a_bad_line_costs_replies_but_never_the_stop(tmp_path):
    with wired("khepera3", tmp_path) as wiring, running(wiring.config) as node:
        node.wait_until_ready()
        wiring.pty.faults = Faults(drop=0.1, truncate=0.1, garbage=0.1, error=0.1, split=3, gap=0.002, seed=1)
        node.drive(2.0, 0.1)
        wait_for(lambda: not wiring.moving())
        wiring.pty.faults = Faults()
        node.published.clear()
        wait_for(lambda: node.status()["level"] == 0)
        assert int(node.values()["failed exchanges"]) > 0
        assert not wiring.moving()


@BOTH
def test_two_drivers_do_not_share_a_robot(tmp_path):
    with (
        wired("koala", tmp_path) as wiring,
        running(wiring.config) as first,
        running(wiring.config) as second,
    ):
        wait_for(
            lambda: "in use by another program" in first.status()["message"] + second.status()["message"]
        )
        wait_for(lambda: {first.status()["level"], second.status()["level"]} == {0, 2})
        stopped = wiring.stop_motors()
        assert stopped.returncode == 0
        assert "in use by another program" in stopped.stdout


@BOTH
def test_a_line_that_a_dying_driver_still_holds_is_waited_for(tmp_path):
    with wired("koala", tmp_path) as wiring:
        dying = Port(str(wiring.device), config_for("koala").serial)
        release = threading.Timer(1.0, dying.close)
        release.start()
        stopped = wiring.stop_motors()
        release.join()
        assert stopped.stdout == "koala confirmed the stop\n"


@BOTH
def test_there_is_nothing_to_stop_on_a_line_that_is_absent(tmp_path):
    with wired("koala", tmp_path) as wiring:
        wiring.unplug()
        stopped = wiring.stop_motors()
        assert stopped.returncode == 0
        assert "device is missing" in stopped.stdout


@BOTH
def test_an_unconfirmed_stop_is_reported_within_two_seconds(tmp_path):
    with wired("koala", tmp_path) as wiring:
        wiring.pty.faults = Faults(drop=1.0)
        stopped = wiring.stop_motors()
        assert stopped.returncode == 1
        assert "did not confirm the stop" in stopped.stderr
        assert wiring.pty.snapshot().last_command == "D,0,0"


@BOTH
def test_systemd_receives_ready_watchdog_and_status(tmp_path, promise):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd, wired("koala", tmp_path) as wiring:
        systemd.bind(str(tmp_path / "notify"))
        systemd.settimeout(PATIENCE)
        environment = {"NOTIFY_SOCKET": str(tmp_path / "notify"), "WATCHDOG_USEC": "300000"}
        with running(wiring.config, **environment) as node:
            received: list[tuple[float, str]] = []
            queue, began = RunQueue(node.process.pid), time.monotonic()
            while [text for _, text in received].count("WATCHDOG=1") < 20:
                received.append((time.monotonic(), systemd.recv(4096).decode()))
            lost = queue.lost()
            node.process.terminate()
            while received[-1][1] != "STOPPING=1":
                received.append((time.monotonic(), systemd.recv(4096).decode()))
    texts = [text for _, text in received]
    beats = [at for at, text in received if text == "WATCHDOG=1"]
    assert "READY=1" in texts
    # Python may load the libraries of ROS for longer than a watchdog waits.
    assert [text for text in texts if "_USEC" in text] == ["WATCHDOG_USEC=10000000", "WATCHDOG_USEC=300000"]
    assert any(text.startswith("STATUS=connected to ") for text in texts)
    count = len(beats) - 1
    assert beats[-1] - began >= 0.09 * count
    promise("notification of a driver's watchdog", (beats[-1] - beats[0] - lost) / count, 0.3)


@pytest.mark.parametrize("program", ["serial_driver.py", "stop_motors.py"])
@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("robot: koala", "'title' is missing"),
        ("[", "cannot read"),
        ("- 1", "params.yaml"),
        (None, "No such file"),
    ],
)
@BOTH
def test_a_useless_parameter_file_is_one_plain_line(program, text, complaint, tmp_path):
    config = tmp_path / "params.yaml"
    if text is not None:
        config.write_text(text)
    command = [sys.executable, str(DRIVERS / program), "--config", str(config)]
    environment = {**os.environ, "PYTHONPATH": PYTHONPATH}
    ended = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    assert ended.returncode == 1
    assert complaint in ended.stderr
    assert "Traceback" not in ended.stderr


LAPTOP = {**TESTER, "name": "laptop", "nodes": [], "addresses": ["192.168.77.10"]}
STRANGER = "/rostopic_77@192.168.77.12"


def test_only_the_declared_commander_reaches_the_wheels(tmp_path):
    """The stranger is named, the commander is not held up, and the robot stops when the commander does."""
    with (
        wired("koala", tmp_path, commanders=[LAPTOP, TESTER]) as wiring,
        running(wiring.config) as node,
    ):
        node.wait_until_ready()
        node.drive(1.5, 0.2, sender=STRANGER)
        assert wiring.pty.snapshot().distance == 0
        complaint = "refuses /rostopic_77 on 192.168.77.12: not among its commanders laptop, tester"
        wait_for(lambda: complaint in node.status()["message"])
        assert node.status()["level"] == 1
        for _ in range(10):
            node.command(0.1, sender="/rostopic_1")
            node.command(0.4, sender=STRANGER)
            time.sleep(0.05)
        assert wiring.pty.snapshot().v == pytest.approx(0.1, rel=0.02)

        def commander() -> str:
            node.command(0.1, sender="/rostopic_1")
            return node.values()["commander"]

        wait_for(lambda: commander() == "laptop (/rostopic_1)", interval=0.05)
        node.drive(0.7, 0.4, sender=STRANGER)
        assert not wiring.moving()


@pytest.mark.parametrize(
    ("host", "why"),
    [
        ("192.168.77.12", "it has the name of a node of tester, which is on 192.168.77.10"),
        ("", "its host is not known"),
    ],
)
def test_the_name_of_a_commander_on_another_host_is_refused(host, why, tmp_path):
    with wired("koala", tmp_path) as wiring, running(wiring.config) as node:
        node.wait_until_ready()
        node.drive(0.5, 0.2, sender=f"/tester@{host}")
        assert wiring.pty.snapshot().distance == 0
        wait_for(lambda: f": {why}" in node.status()["message"])


@BOTH
def test_a_higher_commander_takes_over_until_its_timeout(tmp_path, promise):
    with (
        wired(
            "koala", tmp_path, commanders=[TESTER, {**TESTER, "nodes": ["/joystick"], "priority": 1}]
        ) as wiring,
        running(wiring.config) as node,
    ):
        node.wait_until_ready()
        node.drive(0.5, 0.1)
        took, last = overtaking(node, wiring, 0.2, "/joystick")
        promise("a higher commander sends, until the robot obeys", took, 0.3)
        took, _ = overtaking(node, wiring, 0.1, "/tester")
        assert time.monotonic() - last >= 0.4
        promise("a higher commander ends, until the robot obeys the next", took, 0.6)


def overtaking(node, wiring, linear, sender):
    """Seconds until the robot drives as ``sender`` wants, less those lost; when its last command was sent."""
    queue, began = RunQueue(node.process.pid), time.monotonic()
    last = began

    def obeyed():
        nonlocal last
        if wiring.pty.snapshot().v == pytest.approx(linear, rel=0.02):
            return True
        last = time.monotonic()
        node.command(linear, sender=sender)
        return False

    wait_for(obeyed, interval=0.02)
    return time.monotonic() - began - queue.lost(), last


def test_a_flood_of_a_stranger_does_not_keep_the_robot_from_stopping(tmp_path, promise):
    with (
        wired("koala", tmp_path) as wiring,
        running(wiring.config) as node,
    ):
        node.wait_until_ready()
        node.drive(0.3, 0.1)
        queue, last = RunQueue(node.process.pid), time.monotonic()
        node.command(0.1)

        def stands():
            for _ in range(50):
                node.command(0.4, sender=STRANGER)
            return not wiring.moving()

        wait_for(stands, interval=0.0)
        took = time.monotonic() - last
        promise("commands end in a stranger's flood, until the robot stands", took - queue.lost(), 0.6)


@BOTH
def test_a_file_that_is_no_serial_port_is_called_so():
    with pytest.raises(PortError, match=r"^/dev/null is not a serial port$"):
        Port("/dev/null", config_for("koala").serial)
