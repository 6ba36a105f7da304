"""Runs a node that moves a robot: its parameter file, its loop in a thread of its own, its exit status.

The loop starts before ROS is imported and ends with a stop of the robot, whatever happens in between.
"""

from __future__ import annotations

import argparse
import contextlib
import faulthandler
import os
import signal
import sys
from concurrent import futures
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from types import FrameType
from typing import Callable, Protocol, Sequence, TypeVar

from swarm_onboard.command.command_mailbox import CommandMailbox
from swarm_onboard.common.parameters import ConfigError
from swarm_onboard.common.systemd import REJOINS, Notifier
from swarm_onboard.ros import node as ros
from swarm_onboard.ros.arguments import own_arguments

_LOOK_EVERY = 1.0  # s between two looks whether the master knows the node
_MISSES = 2
_NEW_MASTER = "the ROS master was restarted: this node ends, so that a new one joins it"
_SHUT_DOWN = "ROS has failed in this process: a new one is to replace it"


class TerminatedError(BaseException):
    """A signal ends the node. Not an Exception, so that no library catches it."""


class UnregisteredError(Exception):
    """The node is no longer part of the graph: why, as text for people, and the exit code."""

    def __init__(self, why: str, code: int = os.EX_TEMPFAIL) -> None:
        super().__init__(why)
        self.code = code


def end_on_signals() -> None:
    """Raises ``TerminatedError`` in the main thread at the first SIGTERM, SIGINT or SIGHUP."""
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(number, _terminate)


def watch(loop: Future[None], forgotten: Callable[[], bool]) -> None:
    """Waits for the end of the loop and raises its exception.

    Raises ``UnregisteredError`` if it ends without one, or if the master twice does not know the node.
    """
    misses = 0
    while not futures.wait([loop], _LOOK_EVERY).done:
        misses = misses + 1 if forgotten() else 0
        if misses == _MISSES:
            raise UnregisteredError(_NEW_MASTER, REJOINS)
    loop.result()
    raise UnregisteredError(_SHUT_DOWN)


def _terminate(number: int, _frame: FrameType | None) -> None:
    signal.signal(number, signal.SIG_IGN)
    raise TerminatedError


_LONGEST_WAIT = 1.0  # s
_LONGEST_IMPORT = (
    10.0  # s in which Python may load rclpy's libraries and run no other thread; nobody commands yet
)


class Node(Protocol):
    """What differs between such nodes."""

    @property
    def commands(self) -> CommandMailbox:
        """Its commands; stopping them ends its loop."""

    def run(self, beat: Callable[[], None], longest_wait: float) -> None:
        """Moves the robot until the commands are stopped, then stops it.

        Calls ``beat`` at least every ``longest_wait`` seconds.
        """

    def join(self, loop: Future[None]) -> ros.Node:
        """Becomes a node of ROS and returns it, however long that takes.

        ``loop`` is done when ``run`` has returned.
        """

    def leave(self) -> None:
        """Disconnects from ROS."""


Parameters = TypeVar("Parameters")


def main(
    arguments: Sequence[str],
    description: str,
    load: Callable[[Path], Parameters],
    node: Callable[[Parameters, Notifier], Node],
) -> int:
    """Runs the node that ``node`` makes of the file ``--config``. Returns the exit status of the program.

    ``load`` reads the file and may raise ``ConfigError``.
    """
    faulthandler.enable()  # systemd's watchdog sends SIGABRT: the journal then says where the node hung
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--config", type=Path, required=True, help="parameter file of the robot")
    options = parser.parse_args(own_arguments(arguments))
    try:
        config = load(options.config)
    except ConfigError as error:
        print(error, file=sys.stderr)
        return 1
    end_on_signals()
    try:
        notifier = Notifier()
        _run(node(config, notifier), notifier)
    except TerminatedError:
        pass
    except UnregisteredError as error:
        print(error, file=sys.stderr)
        return error.code
    return 0


def _run(node: Node, notifier: Notifier) -> None:
    """Runs until a signal ends the node. An exception in its loop is raised here, after the last stop."""
    wait = min(_LONGEST_WAIT, notifier.interval or _LONGEST_WAIT)
    with contextlib.ExitStack() as stack:
        stack.callback(node.leave)
        pool = stack.enter_context(ThreadPoolExecutor(1, "loop"))
        stack.callback(node.commands.stop)  # a signal at any moment from here on ends the loop
        stack.callback(notifier.stopping)
        loop = pool.submit(node.run, notifier.beat, wait)
        notifier.ready()  # a master that is away may take as long as it takes
        with notifier.seldom_beating(_LONGEST_IMPORT):
            joined = node.join(loop)
        watch(loop, joined.is_forgotten)
