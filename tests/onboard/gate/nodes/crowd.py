"""Opens connections and holds them: ``crowd.py ADDRESS PORT COUNT``. Prints how many there are, then waits.

It comes from an address of its own. Those that the other end closes are not replaced.
"""

from __future__ import annotations

import json
import resource
import socket
import sys
import time

FROM = "127.0.0.66"

_, most = resource.getrlimit(resource.RLIMIT_NOFILE)
resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))
place = (sys.argv[1], int(sys.argv[2]))
held = [socket.create_connection(place, source_address=(FROM, 0)) for _ in range(int(sys.argv[3]))]
print(json.dumps({"t": time.monotonic(), "held": len(held)}), flush=True)
time.sleep(1e6)
