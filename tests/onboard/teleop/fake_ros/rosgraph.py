"""As much of rosgraph as teleop touches: a master that answers `lookupNode`."""

from __future__ import annotations

import os
import threading
from functools import lru_cache
from pathlib import Path
from typing import Any
from xmlrpc.server import SimpleXMLRPCServer


@lru_cache
def get_master_uri() -> str:
    server = SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False)
    server.register_function(_lookup, "lookupNode")
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return f"http://127.0.0.1:{server.server_address[1]}/"


def _lookup(_caller: str, _node: str) -> list[Any]:
    if (Path(os.environ["FAKE_ROS"]) / "restarted").exists():
        return [-1, "unknown node", ""]
    return [1, "", "http://127.0.0.1:9/"]
