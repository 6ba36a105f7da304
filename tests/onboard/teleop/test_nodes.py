"""The programs as they run: what reaches the robots, and that they are stopped however it ends."""

from __future__ import annotations

import shutil
import signal
import socket
import subprocess
import tempfile
import termios
import time
from pathlib import Path

import pytest
from swarm_onboard.teleop.driving import ZEROS

from tests.onboard.teleop.teleop_process import (
    DEADMAN,
    ROBOTS,
    Joystick,
    a_world,
    joystick_program,
    keyboard_program,
)
from tests.timing import PATIENCE, wait_for

STOPPED = [(0.0, 0.0)] * ZEROS
AHEAD = (0.2, 0.0)
WHOLE_HOLD = 20  # commands in 2 s


def driving(world, count=3):
    """Both robots go ahead."""
    wait_for(lambda: min(world.commands(robot).count(AHEAD) for robot in ROBOTS) >= count)


def stopped(world):
    """Both robots were stopped, often enough, and then nothing was published."""
    wait_for(lambda: all(world.commands(robot)[-ZEROS:] == STOPPED for robot in ROBOTS))
    counts = [len(world.commands(robot)) for robot in ROBOTS]
    time.sleep(0.2)
    assert counts == [len(world.commands(robot)) for robot in ROBOTS]
    for robot in ROBOTS:
        moves = [place for place, twist in enumerate(world.commands(robot)) if twist != (0.0, 0.0)]
        assert len(world.commands(robot)) - 1 - moves[-1] == ZEROS


def drive_by_topic(world):
    wait_for(lambda: any("subscribes" in one for one in world.records()))
    world.joy(0.0, 1.0, held=False)
    time.sleep(0.15)
    for _ in range(5):
        world.joy(0.0, 1.0, held=True)
        time.sleep(0.05)
    driving(world)


def logged(world, word):
    """Returns how often the program has logged ``word``."""
    return sum(line.startswith(word) for line in world.log.read_text().splitlines())


def test_a_joystick_drives_all_robots_until_the_button_is_let_go(tmp_path):
    with a_world(tmp_path) as world, joystick_program(world):
        drive_by_topic(world)
        world.joy(0.0, 1.0, held=False)
        stopped(world)
        assert {"node": "/joystick"}.items() <= world.records()[0].items()
        assert {"subscribes": "joy"}.items() <= world.records()[1].items()
        assert {(one["topic"], one["stamped"]) for one in world.records() if "topic" in one} == {
            ("/koala/cmd_vel", False),
            ("/epuck/cmd_vel", True),
        }


def test_a_joy_node_that_repeats_nothing_is_noticed(tmp_path):
    with a_world(tmp_path) as world, joystick_program(world):
        drive_by_topic(world)
        stopped(world)
        assert "autorepeat_rate" in world.log.read_text()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_a_signal_stops_the_robots_before_ros_is_left(number, tmp_path):
    with a_world(tmp_path, joy_timeout=2.0) as world, joystick_program(world) as program:
        drive_by_topic(world)
        program.send_signal(number)
        assert program.wait(PATIENCE) == 0
        stopped(world)
        assert "shutdown" in world.records()[-1]


def test_a_shutdown_by_the_master_stops_the_robots_first(tmp_path):
    with a_world(tmp_path, joy_timeout=2.0) as world, joystick_program(world) as program:
        drive_by_topic(world)
        world.flag("kicked")
        assert program.wait(PATIENCE) == 0
        stopped(world)


def test_a_fault_of_the_program_stops_the_robots(tmp_path):
    with a_world(tmp_path, joy_timeout=2.0) as world, joystick_program(world) as program:
        drive_by_topic(world)
        world.flag("failing")
        assert program.wait(PATIENCE) == 1
        assert world.commands()[-ZEROS:] == STOPPED


@pytest.fixture
def stick():
    """Below /dev, where a joystick has to be."""
    folder = Path(tempfile.mkdtemp(dir="/dev/shm"))
    yield Joystick(folder / "js0")
    shutil.rmtree(folder)


def test_a_device_that_returns_must_be_released_before_it_drives(stick, tmp_path):
    with a_world(tmp_path, device=str(stick.path)) as world, joystick_program(world):
        wait_for(lambda: logged(world, "waits"))
        stick.plug()
        wait_for(lambda: logged(world, "ready"))
        stick.push(1, -32767)
        stick.press(DEADMAN)
        driving(world)
        time.sleep(0.6)
        assert world.commands()[-1] == AHEAD, "a held stick needs no events"
        stick.unplug()
        stopped(world)
        before = len(world.commands())
        stick.plug(held=(DEADMAN,))
        stick.push(1, -32767)
        wait_for(lambda: logged(world, "waits for the dead-man button"))
        assert len(world.commands()) == before
        stick.press(DEADMAN, down=False)
        wait_for(lambda: logged(world, "ready") == 2)
        stick.press(DEADMAN)
        wait_for(lambda: AHEAD in world.commands()[before:])
        assert f"waits for the joystick: {stick.path}: it is not plugged in\n" in world.log.read_text()


def test_systemd_receives_each_change_of_the_state_once(stick, tmp_path, monkeypatch):
    monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "notify"))
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(str(tmp_path / "notify"))
        systemd.settimeout(PATIENCE)
        with a_world(tmp_path, device=str(stick.path)) as world, joystick_program(world):
            absent = f"STATUS=waits for the joystick: {stick.path}: it is not plugged in"
            assert systemd.recv(4096).decode() == absent
            stick.plug(held=(DEADMAN,))
            assert systemd.recv(4096) == b"STATUS=waits for the dead-man button to be let go"
            stick.press(DEADMAN, down=False)
            assert systemd.recv(4096) == b"STATUS=ready: hold the dead-man button to drive"


def test_a_program_whose_master_is_away_can_be_ended(tmp_path):
    with a_world(tmp_path) as world:
        world.flag("away")
        with joystick_program(world) as program:
            wait_for((world.folder / "joining").exists)
            program.terminate()
            assert program.wait(PATIENCE) == 0
            assert world.records() == []


def test_a_held_key_drives_all_robots_until_it_is_let_go(tmp_path):
    with a_world(tmp_path, "/keys") as world, keyboard_program(world) as keyboard:
        keyboard.hold("i", 1.0)
        driving(world, count=10)
        stopped(world)
        keyboard.type("\x1b[D")
        wait_for(lambda: world.commands()[-1] == (0.0, 1.0))
        keyboard.type("k")
        stopped(world)
        assert b"koala, epuck" in keyboard.screen


def test_keys_change_the_speeds_and_choose_a_robot(tmp_path):
    with a_world(tmp_path, "/keys", speed=0.1) as world, keyboard_program(world) as keyboard:
        keyboard.type("w2")
        keyboard.hold("u", 0.5)
        wait_for(lambda: world.commands("epuck"))
        assert world.commands("epuck")[0] == (pytest.approx(0.11), 1.0)
        assert world.commands("koala") == []


def ended_by_signal(number):
    return lambda keyboard: keyboard.signal(number)


@pytest.mark.parametrize(
    "end",
    [
        *(ended_by_signal(number) for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT)),
        lambda keyboard: keyboard.type("\x03"),
        lambda keyboard: keyboard.type("\x04"),
    ],
    ids=["SIGTERM", "SIGHUP", "SIGINT", "Ctrl-C", "Ctrl-D"],
)
def test_the_keyboard_ends_with_robots_stopped_and_terminal_reset(end, tmp_path):
    with a_world(tmp_path, "/keys", first_hold=2.0) as world, keyboard_program(world) as keyboard:
        assert not keyboard.settings()[3] & (termios.ICANON | termios.ECHO)
        keyboard.type("i")
        driving(world)
        end(keyboard)
        assert keyboard.wait() == 0
        stopped(world)
        assert keyboard.settings()[3] & termios.ICANON
        assert keyboard.settings()[3] & termios.ECHO
        assert keyboard.settings()[0] & termios.IXON


def test_a_fault_gives_the_terminal_back_as_well(tmp_path):
    with a_world(tmp_path, "/keys", first_hold=2.0) as world, keyboard_program(world) as keyboard:
        keyboard.type("j")
        wait_for(world.commands)
        world.flag("failing")
        keyboard.type("i")
        assert keyboard.wait() == 1
        assert world.commands()[-ZEROS:] == STOPPED
        assert keyboard.settings()[3] & termios.ICANON


def test_a_lost_connection_stops_the_robots(tmp_path):
    with a_world(tmp_path, "/keys", first_hold=2.0) as world, keyboard_program(world) as keyboard:
        keyboard.type("i")
        driving(world)
        keyboard.hang_up()
        assert keyboard.wait() == 0
        stopped(world)


def test_ctrl_z_and_ctrl_s_are_keys_that_stop(tmp_path):
    with a_world(tmp_path, "/keys", first_hold=2.0) as world, keyboard_program(world) as keyboard:
        for key in "\x1a\x13":
            wait_for(lambda key=key: sent_until_stopped(world, keyboard, key) < WHOLE_HOLD / 2)


def sent_until_stopped(world, keyboard, key):
    """How often the robots are sent ahead by a pressed key until ``key`` stops them, or the hold is over."""
    before = world.commands().count(AHEAD)
    keyboard.type("i")
    wait_for(lambda: world.commands()[-1:] == [AHEAD])
    keyboard.type(key)
    wait_for(lambda: world.commands()[-1:] == STOPPED[:1])
    stopped(world)
    return world.commands().count(AHEAD) - before


def test_a_restarted_master_is_joined_again(tmp_path):
    with a_world(tmp_path, "/keys", first_hold=2.0) as world, keyboard_program(world) as keyboard:
        world.flag("restarted")
        wait_for(lambda: sum("node" in one for one in world.records()) == 2)
        assert b"the ROS master was restarted: joining it again" in keyboard.screen
        wait_for(lambda: keyboard.screen.count(b"m/s") > keyboard.screen.count(b"restarted"))
        time.sleep(0.3)
        keyboard.type("i")
        driving(world)


def test_keys_need_a_terminal(tmp_path):
    with a_world(tmp_path, "/keys") as world:
        ended = run(world.command("teleop_key.py"), world)
        assert (ended.returncode, "ssh -t" in ended.stderr) == (1, True)


@pytest.mark.parametrize("program", ["teleop_joy.py", "teleop_key.py"])
@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("node: /a", "'targets' is missing"),
        ("{node: /a, targets: []}", "no robot to command"),
        ("{node: /a, targets: [{robot: k3, topic: /k3/cmd_vel}], params: {rate: 0}}", "`rate` cannot be 0"),
        ("{node: /a, targets: [{robot: k3, topic: /k3/cmd_vel}], params: {rat: 5}}", "no setting `rat`"),
        ("[", "cannot read"),
        ("- 1", "params.yaml"),
    ],
)
def test_a_useless_parameter_file_is_one_plain_line(program, text, complaint, tmp_path):
    with a_world(tmp_path) as world:
        world.config.write_text(text)
        ended = run(world.command(program), world)
        assert ended.returncode == 1
        assert complaint in ended.stderr
        assert "Traceback" not in ended.stderr


def run(command, world):
    return subprocess.run(
        command, env=world.environment, stdin=subprocess.DEVNULL, capture_output=True, text=True,
        timeout=PATIENCE, check=False,
    )  # fmt: skip
