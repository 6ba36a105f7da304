"""A unit's start waits for its own master; anything else that answers there is reported in one line."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from xmlrpc.server import SimpleXMLRPCServer

import pytest

from swarmctl.resources import templates
from tests.timing import PATIENCE

PROGRAM = templates() / "ros1/wait-for-master"


class WebPage(BaseHTTPRequestHandler):
    def do_POST(self) -> None:
        self.send_response(200)
        self.end_headers()
        self.wfile.write(b"<html>It works!")

    def log_message(self, *_: Any) -> None:
        pass


def test_a_web_server_is_no_master() -> None:
    with ThreadingHTTPServer(("127.0.0.1", 0), WebPage) as server:
        threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}).start()
        uri = f"http://127.0.0.1:{server.server_address[1]}/"
        command = [sys.executable, str(PROGRAM), uri, "--within", "0.3"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
        server.shutdown()
    assert (done.returncode, done.stderr) == (1, f"no ROS master answers at {uri} after 0.3 s\n")


ROSOUT = ["/rosout_agg", ["/rosout"]]
ODOM, CLOCK = ["/odom", ["/k3/driver"]], ["/clock", ["/replay"]]
SUBSCRIBED = ["/clock", ["/k3/driver"]]
EARLY = "/k3/driver registered before /use_sim_time was set: the master starts again\n"


@pytest.mark.parametrize(
    ("looks", "code", "printed"),
    [
        ([([ROSOUT], [])], 0, ""),
        ([([ROSOUT, ODOM], [])], 1, EARLY),
        ([([ROSOUT, ODOM], []), ([ROSOUT, ODOM], [SUBSCRIBED])], 0, ""),
        ([([ROSOUT, CLOCK], [])], 0, ""),
    ],
    ids=["nobody", "has read it", "reads it now", "the clock itself"],
)
def test_a_node_that_was_quicker_than_the_clock(
    looks: list[tuple[list[Any], list[Any]]], code: int, printed: str
) -> None:
    """One that read /use_sim_time before it was set does not subscribe to /clock: the master starts again."""
    calls: list[tuple[Any, ...]] = []

    def state(_: str) -> list[Any]:
        publishers, subscribers = looks.pop(0) if len(looks) > 1 else looks[0]
        return [1, "", [publishers, subscribers, []]]

    with SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False) as master:
        master.register_function(lambda _: [1, "", os.getpid()], "getPid")
        master.register_function(lambda *given: calls.append(given) or [1, "", 0], "setParam")
        master.register_function(state, "getSystemState")
        threading.Thread(target=master.serve_forever, kwargs={"poll_interval": 0.01}).start()
        uri = f"http://127.0.0.1:{master.server_address[1]}/"
        command = [sys.executable, str(PROGRAM), uri, "--use-sim-time"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
        master.shutdown()
    assert calls == [("/swarm", "/use_sim_time", True)]
    assert (done.returncode, done.stderr) == (code, printed)
