"""Keeps a node of ROS 1 registered that only its unit ends: it ignores requests, and takes its name back."""

from __future__ import annotations

import contextlib
import sys
import time
from typing import Any

import rospy
from rospy.impl.masterslave import ROSHandler
from rospy.impl.registration import get_registration_listeners, get_service_manager, get_topic_manager

from swarm_onboard.ros1 import master

_TAKES_BACK_EVERY = 5.0  # s at least: two nodes of one name do not storm the master
_LONGEST_REASON = 200


def ignore_shutdown_requests() -> None:
    """Call it before joining. A master asks a node to end when another one, of anybody, has its name."""
    ROSHandler.shutdown = _ignored


def _ignored(_handler: ROSHandler, _caller: Any, reason: Any = "") -> tuple[int, str, int]:
    text = "".join(one if one.isprintable() else " " for one in str(reason)[:_LONGEST_REASON])
    # The first line is the one of rospy, in which `status` finds who has taken the name.
    print(
        f"shutdown request: {text}\nWARN: ignored: only its unit ends this node", file=sys.stderr, flush=True
    )
    return 1, "this node ends with its unit only", 0


class Registration:
    """That of the node of this process at its master, which knows it already."""

    def __init__(self) -> None:
        self._master = 0
        with contextlib.suppress(Exception):  # it went away meanwhile: the next one counts as another
            self._master = master.pid()
        self._next = -float("inf")

    def is_kept(self) -> bool:
        """Takes the name back if the master has it elsewhere or no more.

        Returns False if that is another master than before: it was restarted.
        """
        try:
            uri = master.node_uri(rospy.get_name())
            if uri == rospy.get_node_uri():
                return True
            if master.pid() != self._master:
                return False
            if time.monotonic() >= self._next:
                self._next = time.monotonic() + _TAKES_BACK_EVERY
                where = f"was at {uri[:80]}" if uri else "was lost"
                print(f"WARN: registration {where}: taken back", file=sys.stderr, flush=True)
                _register()
        except Exception:  # noqa: BLE001  a master that is away forgets nothing, and whatever else answers is none
            pass
        return True


def _register() -> None:
    """Registers what this node has, in one request, and connects to publishers that came meanwhile."""
    topics = get_topic_manager()
    subscribed = topics.get_subscriptions()
    found = master.register(topics.get_publications(), subscribed, get_service_manager().get_services())
    for (topic, _), publishers in zip(subscribed, found):
        for listener in get_registration_listeners().listeners:
            listener.publisher_update(topic, publishers)
