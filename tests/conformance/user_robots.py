"""A beetle on a pty: an invented robot with the faults that real ones are built with, and its type."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from swarmctl.lab.emulators import Chassis, LineRobot, reply
from swarmctl.lab.emulators.serial_robot import Port

TYPE = """\
title: Beetle
link: {kinds: [serial], baud: 115200, settle: 0.01, hint: is it asleep?}
kinematics:
  wheel_separation: 0.08
  wheel_speed_max: 0.25
  counter_bits: 16
  scales: [{speed_units_per_mps: 1000, metres_per_count: 0.0005}]
protocol:
  kind: line
  error_heads: ["!"]
  reply_timeout: 1.0   # a loaded machine is late
  set_speed: {send: "S,{left},{right}", reply: s}
  identify: {send: B, reply: b}
  queries:
    position: {send: P, reply: p, values: 2}
    eyes: {send: E, reply: e, values: 2}
    battery: {send: V, reply: v, values: 1}
sensors:
  odom: {kind: wheels, read: position}
  battery: {kind: battery, rate: 1, volts: [0.01], empty: 3.4, full: 4.2}
  eyes:
    kind: range
    rate: 5
    max_reading: 255
    distances: [[10, 0.3], [255, 0.0]]
    field_of_view_deg: 20
    elements:
      - {name: left, x: 0.04, y: 0.02, heading_deg: 20}
      - {name: right, x: 0.04, y: -0.02, heading_deg: -20}
actuators:
  lamp: {send: "L,{value}", reply: l, channels: [lamp], max: 1}
firmware_dead_man: false
"""


OWN = """\
title: Beetle
link: {kinds: [serial], baud: 115200, settle: 0.01}
kinematics:
  wheel_separation: 0.08
  wheel_speed_max: 0.25
  counter_bits: 16
  scales: [{speed_units_per_mps: 1000, metres_per_count: 0.0005}]
protocol:
  kind: python
  codec: BeetleCodec
  reply_timeout: 1.0
  set_speed: {request: 16, reply: 16}
  queries:
    position: {values: 2, request: 2, reply: 16}
sensors:
  odom: {kind: wheels, read: position}
firmware_dead_man: false
"""


class Beetle(LineRobot):
    """S sets speeds in mm/s, P reads the counters, E the eyes, V the battery, L is the lamp."""

    type_name = "beetle"
    refusal = b"!\r\n"

    def __init__(self, fault: str = "") -> None:
        super().__init__(Chassis(wheel_separation=0.08, metres_per_count=0.0005, counter_bits=16))
        self.fault = fault
        self.commanded_at = 0.0
        self.sulks = 0  # requests that it will not answer

    def answer(self, line: str) -> bytes:
        self.sulks -= self.sulks > 0
        if self.sulks:
            return b""
        match line.split(","):
            case ["B"]:
                return b"" if self.fault == "no firmware" else reply("b", "beetle", 1)
            case ["S", left, right]:
                return self._drive(int(left) / 1000, int(right) / 1000)
            case ["P"]:
                return self._counters()
            case ["E"]:
                return reply("e", 12, 999 if self.fault == "wild eyes" else 14)
            case ["V"]:
                return reply("v", 38 if self.fault == "flat battery" else 380)
            case ["L", "0" | "1"] if self.fault != "no lamp":
                return reply("l")
        if self.fault == "takes offence":
            self.sulks = 8
        return self.refusal

    def advance(self, dt: float) -> None:
        left = self.commanded_at + 0.3 - self.chassis.time
        if self.fault == "dead-man" and left <= dt:
            super().advance(max(0.0, left))
            self.chassis.drive(0.0, 0.0)
            dt -= max(0.0, left)
        super().advance(dt)

    def _drive(self, left: float, right: float) -> bytes:
        self.commanded_at = self.chassis.time
        match self.fault:
            case "mute":
                return b""
            case "twice as fast":
                left, right = left * 2, right * 2
            case "a bit fast":
                left, right = left * 1.15, right * 1.15
            case "swapped":
                left, right = right, left
            case "backward":
                left, right = -left, -right
            case "one wheel":
                right = 0.0
            case "no wheels":
                left = right = 0.0
            case "never stops" if left == right == 0.0:
                return reply("s")
        self.chassis.drive(left, right)
        return reply("s")

    def _counters(self) -> bytes:
        left, right = self.chassis.left.count, self.chassis.right.count
        if self.fault == "counters stand":
            return reply("p", 0, 0)
        if self.fault == "left counter backward":
            return reply("p", -left, right)
        return reply("p", left) if self.fault == "short reply" else reply("p", left, right)


@contextmanager
def beetle(fault: str = "") -> Iterator[Port]:
    with Port(Beetle(fault)) as port:
        yield port
