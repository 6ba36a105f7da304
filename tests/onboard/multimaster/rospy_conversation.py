"""A rospy talker on one island, a listener on another: measures the time to recover from each fault.

rospy_conversation.py IMAGE
"""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

from tests.onboard.multimaster.many_islands import Archipelago, address, parameters, sync_node
from tests.timing import PATIENCE, wait_for

TOPIC, KIND = "/north/chatter", "std_msgs/String"
TALKER = f"""
import rospy
from std_msgs.msg import String
rospy.init_node("talker", disable_signals=True)
publisher, rate = rospy.Publisher("{TOPIC}", String, queue_size=1), rospy.Rate(20)
while True:
    publisher.publish("hello")
    rate.sleep()
"""
LISTENER = f"""
import rospy, time
from std_msgs.msg import String
rospy.init_node("listener", disable_signals=True)
rospy.Subscriber("{TOPIC}", String, lambda _: print(time.monotonic(), flush=True))
time.sleep(1e6)
"""


class Conversation:
    def __init__(self, image: Path) -> None:
        self.islands = Archipelago(image)
        self._received = self.islands.root / "received"
        self._nodes: dict[str, subprocess.Popen[bytes]] = {}
        for island, received in (("north", {"east": []}), ("east", {"north": [TOPIC]})):
            self.islands.start_master(island)
            self.islands.configure(island, parameters(island, received, KIND, remove_after=60.0))
            self.islands.start_sync(island)
        self.start("north", TALKER)
        self.start("east", LISTENER)

    def start(self, island: str, code: str) -> None:
        """Restart the node of ``island``, as its unit would."""
        if island in self._nodes:
            self._nodes[island].kill()
            self._nodes[island].wait()
        with self._received.open("ab") as out:
            self._nodes[island] = self.islands.popen(island, "python3", "-c", code, stdout=out)

    def seconds_until_received(self) -> float:
        """Wait for three more messages; returns the s until the first of them."""
        start = time.monotonic()
        while sum(when > start for when in self._times()) < 3:
            if time.monotonic() - start > PATIENCE:
                return float("inf")
            time.sleep(0.02)
        return round(next(when for when in self._times() if when > start) - start, 2)

    def quiet(self, seconds: float) -> bool:
        """Return whether no message is received for ``seconds``."""
        start = time.monotonic()
        time.sleep(seconds)
        return not any(when > start + 0.5 for when in self._times())

    def _times(self) -> list[float]:
        *whole, _ = self._received.read_text().split("\n")
        return [float(line) for line in whole]

    def restart_master(self, island: str, node: str) -> None:
        self.islands.kill_master(island)
        self.islands.start_master(island)
        self.start(island, node)

    def sync_uri(self) -> object:
        """The slave API under which the sync of the listener's island is registered there."""
        return self.islands.master("east").lookupNode("/checker", sync_node("east"))

    def break_connections(self) -> None:
        """Destroy the listener's sockets to the talker; it gets an error."""
        self.islands.run_in("east", "ss", "-4", "-t", "-K", "dst", address("north"))


def main() -> None:
    talk = Conversation(Path(sys.argv[1]))
    figures: dict[str, object] = {"first": talk.seconds_until_received()}
    talk.restart_master("north", TALKER)
    figures["talker's master restarted"] = talk.seconds_until_received()
    talk.restart_master("east", LISTENER)
    figures["listener's master restarted"] = talk.seconds_until_received()
    talk.islands.cut("north", "east")
    quiet = talk.quiet(3.0)
    talk.islands.heal()
    figures["healed"] = talk.seconds_until_received()
    talk.islands.cut("north", "east")
    talk.break_connections()
    figures["quiet while cut"] = quiet and talk.quiet(3.0)
    talk.islands.heal()
    figures["healed after the connection broke"] = talk.seconds_until_received()
    killed = talk.sync_uri()
    talk.islands.end_sync("east", signal.SIGKILL)
    talk.islands.start_sync("east")
    figures["sync killed"] = talk.seconds_until_received()
    wait_for(lambda: talk.sync_uri() != killed)  # what the killed one has registered is now its own
    figures["sync stopped"] = round(talk.islands.end_sync("east", signal.SIGTERM), 2)
    state = talk.islands.master("east").getSystemState("/checker")[2][0]
    figures["left behind"] = [topic for topic, _ in state if topic == TOPIC]
    print(talk.islands.log("east"), file=sys.stderr)
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
