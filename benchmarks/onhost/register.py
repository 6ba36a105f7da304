"""How long the master takes to register a node: ``register.py CALLS`` prints one JSON object, a list of ms.

One call on one connection, as rospy makes it; each registration is undone, and counts as another.
"""

from __future__ import annotations

import json
import sys
import time

import rosgraph

URI = f"http://{rosgraph.network.get_host_name()}:40000/"
TOPIC = "/registered"


def main() -> None:
    master = rosgraph.Master("/register")
    calls = (
        lambda: master.registerPublisher(TOPIC, "std_msgs/String", URI),
        lambda: master.unregisterPublisher(TOPIC, URI),
    )
    took = []
    for number in range(int(sys.argv[1])):
        began = time.monotonic()
        calls[number % 2]()
        took.append(1000 * (time.monotonic() - began))
    print(json.dumps(took))


if __name__ == "__main__":
    main()
