"""How often topics come: ``listen.py SECONDS TOPIC ...`` prints one JSON object, Hz by topic."""

from __future__ import annotations

import json
import sys
import time
from collections import Counter

import rospy

COUNTED: Counter[str] = Counter()


def main() -> None:
    rospy.init_node("listen")
    seconds, topics = float(sys.argv[1]), sys.argv[2:]
    for topic in topics:
        rospy.Subscriber(topic, rospy.AnyMsg, lambda _message, topic=topic: COUNTED.update((topic,)))
    time.sleep(2.0)  # until all are connected
    before, began = dict(COUNTED), time.monotonic()
    time.sleep(seconds)
    took = time.monotonic() - began
    print(json.dumps({topic: (COUNTED[topic] - before.get(topic, 0)) / took for topic in topics}))


if __name__ == "__main__":
    main()
