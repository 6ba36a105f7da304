"""The driver node of a robot whose board speaks rosserial, against the emulated rover on a pty."""

from __future__ import annotations

import struct

import pytest

from swarmctl.lab.emulators.arduino_rover import BUFFER, PUBLISHERS, SLOTS, SUBSCRIBERS, ArduinoRover
from swarmctl.lab.emulators.rosserial_device import Device, Message, Topic
from swarmctl.lab.emulators.serial_faults import Faults
from tests.onboard.driver.driver_process import running, wired
from tests.timing import wait_for

ROVER, NAME = "arduino-rover", "arduino_rover"
STRING, STRING_MD5 = "std_msgs/String", "992ce8a1687cec8c8bd883ec73ca41d1"
INT32 = ["std_msgs/Int32", "da5909fbe378aeaf85e547e830cc1bb7"]
#: As String has it, and bytes that are not text: nobody is to look into them.
WORDS = struct.pack("<I", 6) + b"\x00\xff\xfehi\x80"


class Rover(ArduinoRover):
    """A rover whose port resets nothing, with topics beside its type's; ``received`` is what came on them."""

    def __init__(self, publishes: tuple[Topic, ...] = (), subscribes: tuple[Topic, ...] = ()) -> None:
        super().__init__(dtr=False, dead_man=3600.0)
        self.received: list[tuple[str | None, bytes]] = []
        self._device = Device(
            (*PUBLISHERS, *publishes), (*SUBSCRIBERS, *subscribes), slots=SLOTS, buffer=BUFFER
        )

    def say(self, topic: str, message: bytes) -> bytes:
        return self._device.publish(topic, message)

    def _take(self, message: Message) -> None:
        super()._take(message)
        self.received.append((self._device.topic(message), message.payload))


def test_pulses_and_any_other_topic_of_the_sketch_pass_as_they_are(tmp_path):
    rover = Rover((Topic("words", STRING, STRING_MD5),), (Topic("lamp", STRING, STRING_MD5),))
    with wired(ROVER, tmp_path, robot=rover) as wiring, running(wiring.config) as node:
        pulses = wait_for(lambda: node.latest("rwheel"))
        assert (pulses["is"], pulses["bytes"]) == (INT32, "00000000")
        wait_for(lambda: {"topic": "subscribes", "name": "lamp"} in node.published)
        wiring.pty.send(rover.say("words", WORDS))
        received = wait_for(lambda: node.latest("words"))
        assert (received["is"], bytes.fromhex(received["bytes"])) == ([STRING, STRING_MD5], WORDS)
        node.publish("lamp", WORDS)
        wait_for(lambda: ("lamp", WORDS) in rover.received)
        assert {"topic": "subscribes", "name": "lwheel"} not in node.published


def test_commands_drive_it_and_its_pulses_are_odometry(tmp_path):
    with wired(ROVER, tmp_path, robot=Rover()) as wiring, running(wiring.config) as node:
        wait_for(lambda: node.latest("lwheel"))
        node.drive(1.0, 0.3)
        wait_for(lambda: not wiring.moving())
        way = wiring.pty.snapshot().x
        assert way > 0.2
        wait_for(
            lambda: node.latest("odom")["pose"]["pose"]["position"]["x"] == pytest.approx(way, abs=0.011)
        )


def test_a_missing_or_different_type_is_reported_and_the_rest_works(tmp_path):
    rover = Rover((Topic("odd", "my_msgs/Odd", "0" * 32),), (Topic("lamp", STRING, "1" * 32),))
    with wired(ROVER, tmp_path, robot=rover) as wiring, running(wiring.config) as node:
        status = wait_for(lambda: "my_msgs" in node.status()["message"] and node.status())
        assert status["level"] == 1
        assert "`odd` as my_msgs/Odd, which no package on this host has: install my_msgs" in status["message"]
        assert "`lamp` as std_msgs/String of another definition" in status["message"]
        wait_for(lambda: node.latest("lwheel"))
        node.drive(0.3, 0.2)
        node.drive_until(wiring.moving, 0.2)
        wiring.pty.send(rover.say("odd", b"\0"))
        node.drive(0.3, 0.2)
        node.drive_until(wiring.moving, 0.2)
        assert node.latest("odd") is None
        assert {"topic": "subscribes", "name": "lamp"} not in node.published


def test_what_another_sketch_does_not_announce_is_taken_back(tmp_path):
    rover = Rover((Topic("words", STRING, STRING_MD5),), (Topic("lamp", STRING, STRING_MD5),))
    with wired(ROVER, tmp_path, robot=rover) as wiring, running(wiring.config) as node:
        wait_for(lambda: {"topic": "subscribes", "name": "lamp"} in node.published)
        wiring.unplug()
        with wiring.pty.now():
            rover._device = Device(PUBLISHERS, SUBSCRIBERS, slots=SLOTS, buffer=BUFFER)
        wiring.plug()
        wait_for(lambda: {"topic": "no more", "name": "words"} in node.published)
        wait_for(lambda: {"topic": "no more", "name": "lamp"} in node.published)
        node.published.clear()
        wait_for(lambda: node.latest("lwheel"))


def test_a_board_whose_driver_was_killed_is_sent_a_stop(tmp_path):
    """This one's own dead-man would take an hour."""
    rover = Rover()
    with wired(ROVER, tmp_path, robot=rover) as wiring, running(wiring.config) as node:
        wait_for(lambda: node.latest("lwheel"))
        node.drive(0.3, 0.2)
        node.process.kill()
        node.process.wait()
        assert wiring.moving()
        stopped = wiring.stop_motors()
        assert (stopped.returncode, stopped.stdout) == (0, f"{NAME} was sent a stop\n")
        wait_for(lambda: not wiring.moving())
        assert wiring.pty.snapshot().last_command == "tx stop"


def test_a_board_that_does_not_answer_is_left_to_its_own_dead_man(tmp_path):
    with wired(ROVER, tmp_path, robot=Rover()) as wiring:
        wiring.pty.faults = Faults(drop=1.0)
        stopped = wiring.stop_motors()
        assert (stopped.returncode, stopped.stdout) == (
            0,
            f"{NAME} does not answer: its sketch stops it 0.4 s after its last command\n",
        )
