"""The driver node of a robot whose board speaks rosserial, against the emulated rover on a pty."""

from __future__ import annotations

import struct
import time

import pytest
from driver_process import running, wait_for, wired

from swarmctl.lab.emulators.arduino_rover import BUFFER, PUBLISHERS, SLOTS, SUBSCRIBERS, ArduinoRover
from swarmctl.lab.emulators.faults import Faults
from swarmctl.lab.emulators.rosserial_device import Device
from swarmctl.lab.emulators.rosserial_frames import Message, Topic

ROVER, NAME = "arduino-rover", "arduino_rover"
STRING, STRING_MD5 = "std_msgs/String", "992ce8a1687cec8c8bd883ec73ca41d1"
INT32 = ["std_msgs/Int32", "da5909fbe378aeaf85e547e830cc1bb7"]
#: As String has it, and bytes that are no text: nobody is to look into them.
WORDS = struct.pack("<I", 6) + b"\x00\xff\xfehi\x80"


class Rover(ArduinoRover):
    """A rover whose port resets nothing, with topics beside its type's; ``heard`` is what came on them."""

    def __init__(self, publishes: tuple[Topic, ...] = (), hears: tuple[Topic, ...] = ()) -> None:
        super().__init__(dtr=False, dead_man=3600.0)
        self.heard: list[tuple[str | None, bytes]] = []
        self._device = Device((*PUBLISHERS, *publishes), (*SUBSCRIBERS, *hears), slots=SLOTS, buffer=BUFFER)

    def say(self, topic: str, message: bytes) -> bytes:
        return self._device.publish(topic, message)

    def _take(self, message: Message) -> None:
        super()._take(message)
        self.heard.append((self._device.topic(message), message.payload))


def test_pulses_and_any_other_topic_of_the_sketch_pass_as_they_are(tmp_path):
    rover = Rover((Topic("words", STRING, STRING_MD5),), (Topic("lamp", STRING, STRING_MD5),))
    with wired(ROVER, tmp_path, robot=rover) as wiring, running(wiring.config) as node:
        pulses = wait_for(lambda: node.latest("rwheel"))
        assert (pulses["is"], pulses["bytes"]) == (INT32, "00000000")
        wait_for(lambda: {"topic": "hears", "name": "lamp"} in node.heard)
        wiring.pty.send(rover.say("words", WORDS))
        said = wait_for(lambda: node.latest("words"))
        assert (said["is"], bytes.fromhex(said["bytes"])) == ([STRING, STRING_MD5], WORDS)
        node.tell("lamp", WORDS)
        wait_for(lambda: ("lamp", WORDS) in rover.heard)
        assert {"topic": "hears", "name": "lwheel"} not in node.heard


def test_orders_drive_it_and_its_pulses_are_odometry(tmp_path):
    with wired(ROVER, tmp_path, robot=Rover()) as wiring, running(wiring.config) as node:
        wait_for(lambda: node.latest("lwheel"))
        node.drive(1.0, 0.3)
        wait_for(lambda: not wiring.moving())
        way = wiring.pty.snapshot().x
        assert way > 0.2
        wait_for(
            lambda: node.latest("odom")["pose"]["pose"]["position"]["x"] == pytest.approx(way, abs=0.011)
        )


def test_a_type_that_this_host_has_not_or_has_otherwise_is_told_and_the_rest_goes_on(tmp_path):
    rover = Rover((Topic("odd", "my_msgs/Odd", "0" * 32),), (Topic("lamp", STRING, "1" * 32),))
    with wired(ROVER, tmp_path, robot=rover) as wiring, running(wiring.config) as node:
        told = wait_for(lambda: "my_msgs" in node.status()["message"] and node.status())
        assert told["level"] == 1
        assert "`odd` as my_msgs/Odd, which no package on this host has: install my_msgs" in told["message"]
        assert "`lamp` as std_msgs/String of another definition" in told["message"]
        wait_for(lambda: node.latest("lwheel"))
        node.drive(0.3, 0.2)
        assert wiring.moving()
        wiring.pty.send(rover.say("odd", b"\0"))
        node.drive(0.3, 0.2)
        assert wiring.moving()
        assert node.latest("odd") is None
        assert {"topic": "hears", "name": "lamp"} not in node.heard


def test_what_another_sketch_does_not_announce_is_taken_back(tmp_path):
    rover = Rover((Topic("words", STRING, STRING_MD5),), (Topic("lamp", STRING, STRING_MD5),))
    with wired(ROVER, tmp_path, robot=rover) as wiring, running(wiring.config) as node:
        wait_for(lambda: {"topic": "hears", "name": "lamp"} in node.heard)
        wiring.unplug()
        with wiring.pty.now():
            rover._device = Device(PUBLISHERS, SUBSCRIBERS, slots=SLOTS, buffer=BUFFER)
        wiring.plug()
        wait_for(lambda: {"topic": "no more", "name": "words"} in node.heard)
        wait_for(lambda: {"topic": "no more", "name": "lamp"} in node.heard)
        node.heard.clear()
        wait_for(lambda: node.latest("lwheel"))


def test_a_board_whose_driver_was_killed_is_told_to_stop(tmp_path):
    """This one's own dead-man would take an hour."""
    rover = Rover()
    with wired(ROVER, tmp_path, robot=rover) as wiring, running(wiring.config) as node:
        wait_for(lambda: node.latest("lwheel"))
        node.drive(0.3, 0.2)
        node.process.kill()
        node.process.wait()
        assert wiring.moving()
        stopped = wiring.stop_motors()
        assert (stopped.returncode, stopped.stdout) == (0, f"{NAME} was told to stop\n")
        wait_for(lambda: not wiring.moving(), 1.0)
        assert wiring.pty.snapshot().last_command == "tx stop"


def test_a_board_that_does_not_answer_is_left_to_its_own_dead_man_in_time(tmp_path):
    with wired(ROVER, tmp_path, robot=Rover()) as wiring:
        wiring.pty.faults = Faults(drop=1.0)
        began = time.monotonic()
        stopped = wiring.stop_motors()
        assert time.monotonic() - began < 2.0 + 1.0  # what starting it may take on a busy machine
        assert (stopped.returncode, stopped.stdout) == (
            0,
            f"{NAME} does not answer: its sketch stops it 0.4 s after its last order\n",
        )
