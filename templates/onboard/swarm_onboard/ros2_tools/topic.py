"""The program of ``swarmctl topic`` on a host: lists, prints, measures and publishes topics."""

from __future__ import annotations

import os
import signal
import sys

from swarm_onboard.agent.texts import clipped
from swarm_onboard.ros2_probe.observe import UDP

_LONGEST = 500  # characters of an error


def main() -> None:
    """Runs ``list -v``, ``echo TOPIC``, ``hz TOPIC`` or ``pub [-1 | -r HZ] -- TOPIC TYPE YAML``, and exits.

    Any error is one line on standard error, and exit code 1.
    """
    for one in (signal.SIGINT, signal.SIGTERM):
        signal.signal(one, _end)
    os.environ.update(UDP)
    status = 0
    try:
        from swarm_onboard.ros2_tools import topic_verbs  # noqa: PLC0415  rclpy may be broken

        topic_verbs.run(sys.argv[1:])
    except (KeyboardInterrupt, BrokenPipeError):
        pass
    except Exception as error:  # noqa: BLE001  whatever ROS raises, people get its words
        status = 1
        text = " ".join(str(error).split()) or type(error).__name__
        print(f"error: {clipped(text, _LONGEST)}", file=sys.stderr, flush=True)
    os._exit(status)  # some rmw hang while Python ends


def _end(*_: object) -> None:
    """Ends the program once: who closes a connection sends several signals."""
    for one in (signal.SIGINT, signal.SIGTERM):
        signal.signal(one, signal.SIG_IGN)
    raise KeyboardInterrupt
