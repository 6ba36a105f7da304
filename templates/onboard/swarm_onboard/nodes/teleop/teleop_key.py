#!/usr/bin/env python3
"""A keyboard commands robots while a key is held: ``teleop_key.py --config FILE``, by hand in a terminal."""

from __future__ import annotations

import argparse
import contextlib
import os
import sys
import time
from pathlib import Path

from swarm_onboard.ros.arguments import own_arguments
from swarm_onboard.teleop.config import Config, ConfigError, load
from swarm_onboard.teleop.driving import EndedError, Ending, Fanout, Wanted, drive
from swarm_onboard.teleop.keyboard import END, HELP, Keys, Settings, decoded, line, pressed
from swarm_onboard.teleop.terminal import Terminal


class Pilot:
    """Takes keys while it waits, and shows on the terminal what they mean."""

    def __init__(
        self, settings: Settings, robots: tuple[str, ...], terminal: Terminal, ending: Ending
    ) -> None:
        self._settings = settings
        self._robots = robots
        self._terminal = terminal
        self._ending = ending
        self._keys = Keys(settings.speed, settings.turn)
        self._rest = b""

    def look(self) -> Wanted:
        """Shows the state; returns the wanted twist and the chosen robots."""
        now = time.monotonic()
        self._terminal.show(line(self._robots, self._keys, now, self._terminal.width))
        return self._keys.twist(now), self._keys.chosen

    def wait(self, seconds: float) -> None:
        """Reads keys for some seconds."""
        data = self._terminal.read(seconds)
        if data is None:  # the terminal is gone: ssh lost, window closed
            self._ending.requested = True
            return
        new, self._rest = decoded(self._rest + data)
        if self._rest and not data:  # a lone Escape: nothing followed it
            new, self._rest = [*new, "escape"], b""
        if END in new:
            self._ending.requested = True
        self._keys = pressed(self._settings, len(self._robots), self._keys, new, time.monotonic())


def main(arguments: list[str]) -> int:
    """Runs the program. Returns its exit status."""
    parser = argparse.ArgumentParser(description="Drive robots with the keyboard of this terminal.")
    parser.add_argument("--config", type=Path, required=True, help="parameter file of the program")
    options = parser.parse_args(own_arguments(arguments))
    try:
        config = load(options.config, "teleop-key")
    except ConfigError as error:
        print(error, file=sys.stderr)
        return 1
    if not (os.isatty(0) and os.isatty(1)):
        print("keys come from a terminal, and here is none: log in with `ssh -t`", file=sys.stderr)
        return 1
    with contextlib.suppress(EndedError):
        if _run(config, Ending()):
            print("the ROS master was restarted: joining it again", flush=True)
            os.execv(sys.executable, [sys.executable, *sys.argv])
    return 0


def _run(config: Config, ending: Ending) -> bool:
    """Returns whether the master was restarted meanwhile: only a new process can join it."""
    if "ROS_MASTER_URI" in os.environ:
        print("waits for the ROS master at", os.environ["ROS_MASTER_URI"], flush=True)
    from swarm_onboard.teleop import topics  # noqa: PLC0415  a wrong parameter file is reported without ROS

    settings = Settings(
        **config.settings, speed_bounds=config.bounds["speed"], turn_bounds=config.bounds["turn"]
    )
    commander = topics.Commander(config, before_shutdown=ending.end_and_wait)
    forgotten = topics.when_forgotten(commander.node, ending.end_and_wait)
    print(HELP, flush=True)
    try:
        with Terminal() as terminal:
            pilot, fanout = Pilot(settings, config.robots, terminal, ending), Fanout(len(config.robots))
            drive(fanout, ending, pilot.look, commander.send, pilot.wait, period=1 / settings.rate)
    finally:
        commander.leave()
    return forgotten.is_set()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
