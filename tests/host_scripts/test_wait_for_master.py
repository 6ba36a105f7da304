"""A unit's start waits for its own master; anything else that answers there is reported in one line."""

from __future__ import annotations

import subprocess
import sys
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from swarmctl.resources import templates
from tests.timing import PATIENCE

PROGRAM = templates() / "host/wait-for-master"


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
