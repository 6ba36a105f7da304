#!/usr/bin/env python3
"""A joystick commands robots while its dead-man button is held: ``teleop_joy.py --config FILE``."""

from __future__ import annotations

import argparse
import contextlib
import sys
import time
from pathlib import Path
from typing import Protocol

from swarm_onboard.common.systemd import Notifier
from swarm_onboard.ros.arguments import own_arguments
from swarm_onboard.teleop.config import Config, ConfigError, load
from swarm_onboard.teleop.device import Device
from swarm_onboard.teleop.driving import EndedError, Ending, Fanout, Wanted, drive
from swarm_onboard.teleop.gamepad import WAITING, Hand, Pad, Settings, look


class Stick(Protocol):
    """A joystick from any source; ``trouble`` is why there is none."""

    trouble: str

    def poll(self) -> Pad | None:
        """Returns the present state of the gamepad; None without one."""


class Pilot:
    """Reads the joystick; reports changes of its state to systemd, and prints them to stderr."""

    def __init__(self, settings: Settings, robots: tuple[str, ...], stick: Stick) -> None:
        self._notifier = Notifier()
        self._settings = settings
        self._robots = robots
        self._stick = stick
        self._hand = Hand()
        self._state = ""

    def look(self) -> Wanted:
        """Returns the wanted twist and the chosen robots."""
        pad = self._stick.poll()
        self._hand, twist, state = look(self._settings, self._robots, self._hand, pad, time.monotonic())
        if state == WAITING:
            state = f"{WAITING}: {self._stick.trouble}"
        if state != self._state:
            print(state, file=sys.stderr, flush=True)
            self._notifier.status(state)
            self._state = state
        return twist, self._hand.chosen


def main(arguments: list[str]) -> int:
    """Runs the program. Returns its exit status."""
    parser = argparse.ArgumentParser(description="Drive robots with a joystick.")
    parser.add_argument("--config", type=Path, required=True, help="parameter file of the program")
    options = parser.parse_args(own_arguments(arguments))
    try:
        config = load(options.config, "teleop-joy")
    except ConfigError as error:
        print(error, file=sys.stderr)
        return 1
    with contextlib.suppress(EndedError):
        _run(config, Ending())
    return 0


def _run(config: Config, ending: Ending) -> None:
    from swarm_onboard.teleop import topics  # noqa: PLC0415  a wrong parameter file is reported without ROS

    settings = Settings(**config.settings)
    commander = topics.Commander(config, before_shutdown=ending.end_and_wait)
    try:
        stick: Stick = (
            Device(settings.device) if settings.device else topics.JoyTopic(commander.node, settings.topic)
        )
        pilot, fanout = Pilot(settings, config.robots, stick), Fanout(len(config.robots))
        drive(fanout, ending, pilot.look, commander.send, time.sleep, period=1 / settings.rate)
    finally:
        commander.leave()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
