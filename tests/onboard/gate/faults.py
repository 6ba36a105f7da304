"""A gate before a vendor's driver that has no dead-man, with real rospy, and each fault: ``faults.py IMAGE``.

Prints how long the robot drives on after each, in seconds, how many of these the machine kept processes
from running, and what the gate reports.
"""

from __future__ import annotations

import json
import signal
import sys
import time
import xmlrpc.client
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from tests.onboard.gate.ros_host import URI, Node, RosHost, since, wait_until
from tests.timing import PATIENCE, withheld

NAMESPACE = "/tb"
COMMAND, OUTPUT = f"{NAMESPACE}/cmd_vel", f"{NAMESPACE}/gate/cmd_vel"
PARAMETERS = {
    "robot": "tb",
    "odom_frame": "odom",
    "title": "a vendor's robot",
    "namespace": NAMESPACE,
    "command_type": "geometry_msgs/Twist",
    "output_type": "geometry_msgs/Twist",
    "command_timeout": 0.5,
    "rate": 10.0,
    "diagnostics_rate": 5.0,
    "commanders": [
        {
            "name": "boss",
            "priority": 10,
            "nodes": ["/boss"],
            "namespace": None,
            "hosts": ["127.0.0.1"],
            "addresses": [],
        }
    ],
    "motion": {"kind": "differential", "linear_max": 0.22, "angular_max": 2.84, "wheel_separation": 0.16},
}
ZERO = [0.0] * 6
CROWD = 1300  # connections; a process may have 1024 files
WATCHED = 0.6  # s after the first zero, in which the robot must not move again


class Trial:
    """The host with its gate and robot."""

    def __init__(self, image: Path) -> None:
        self.host = RosHost(image, PARAMETERS, Path(__file__).parent / "nodes")
        self.robot = self.host.node("robot.py", NAMESPACE, OUTPUT)
        self.gate = self.host.gate()
        self.boss: Node | None = None
        self.lost = self._withheld = 0.0

    def commands(self, moment: float = 0.0) -> list[Any]:
        """What the robot received after ``moment``."""
        return [line for line in since(self.robot.lines, moment) if "v" in line]

    def drive(self, linear: float = 0.1) -> None:
        """Has the robot driven by who may, until it does."""
        began = time.monotonic()
        if self.boss is None:
            self.boss = self.host.node("sender.py", "/boss", COMMAND, linear, 0.0)
        wait_until(lambda: any(one["v"] != ZERO for one in self.commands(began)), "the robot drives")
        self._withheld = withheld()

    def end_boss(self) -> None:
        if self.boss is not None:
            self.boss.kill()
            self.boss = None

    def stands(self, moment: float) -> float:
        """Returns the s from ``moment`` until the robot received the zero with which it stays."""
        first = wait_until(
            lambda: next((one["t"] for one in self.commands(moment) if one["v"] == ZERO), None),
            "a zero comes",
        )
        self.lost = round(withheld() - self._withheld, 3)
        time.sleep(WATCHED)
        moved = [one for one in self.commands(first) if one["v"] != ZERO]
        return round(first - moment, 3) if not moved else float("inf")

    def report(self, text: str) -> Any:
        """Returns the next status of the gate with ``text`` in its message."""
        began = time.monotonic()
        return wait_until(
            lambda: next(
                (one for one in since(self.robot.lines, began) if text in one.get("message", "")), None
            ),
            f"the gate reports `{text}`",
        )

    def ended(self) -> int:
        """Returns the exit status of the gate."""
        return self.gate.process.wait(PATIENCE)


def publisher_killed(trial: Trial) -> Any:
    trial.drive()
    began = time.monotonic()
    trial.end_boss()
    return {"stands": trial.stands(began)}


def stranger(trial: Trial) -> Any:
    began = time.monotonic()
    other = trial.host.node("sender.py", "/stranger", COMMAND, 0.1, 0.0)
    seen = trial.report("/stranger")
    other.kill()
    moved = [one for one in trial.commands(began) if one["v"] != ZERO]
    return {"moved": len(moved), "level": seen["level"], "message": seen["message"], "values": seen["values"]}


def not_a_number(trial: Trial) -> Any:
    """The commander of a robot that drives sends NaN, infinity, and more than any robot can drive."""
    trial.boss = trial.host.node("sender.py", "/boss", COMMAND, 0.1, 0.1, 20, "nan", "inf", "-inf", "1e300")
    trial.drive()
    began = wait_until(lambda: [line["t"] for line in trial.boss.lines], "NaN is sent")[0]
    stands = trial.stands(began)
    refused = trial.report("as commanded")["values"]["refused commands"]
    trial.boss.process.wait(PATIENCE)
    trial.end_boss()
    moved = [one for one in trial.commands(began + stands) if one["v"] != ZERO]
    return {"stands": stands, "refused": int(refused), "moved": len(moved)}


def too_fast(trial: Trial) -> Any:
    began = time.monotonic()
    trial.drive(9.0)
    trial.report("slowed")
    trial.end_boss()
    trial.stands(time.monotonic())
    return {"fastest": max(abs(one["v"][0]) for one in trial.commands(began))}


def flooded(trial: Trial) -> Any:
    """The commander sends 1000 times a second, and so do two strangers; the commander is killed."""
    strangers = [
        trial.host.node("sender.py", f"/flood_{number}", COMMAND, 0.2, 0.0, 1000) for number in range(2)
    ]
    trial.boss = trial.host.node("sender.py", "/boss", COMMAND, 0.1, 0.0, 1000)
    trial.drive()
    time.sleep(1.0)
    began = time.monotonic()
    trial.end_boss()
    stands = trial.stands(began)
    for one in strangers:
        one.kill()
    fastest = max(one["v"][0] for one in trial.commands(began - 1.0))
    return {"stands": stands, "fastest": fastest}


def commander_stopped(trial: Trial) -> Any:
    """SIGSTOP, then SIGCONT: it commands again."""
    trial.drive()
    assert trial.boss is not None
    began = time.monotonic()
    trial.boss.process.send_signal(signal.SIGSTOP)
    stands = trial.stands(began)
    trial.boss.process.send_signal(signal.SIGCONT)
    trial.drive()
    trial.end_boss()
    return {"stands": stands}


def driver_restarted(trial: Trial) -> Any:
    """The vendor's node is killed and comes back while commands flow, and again after they ended."""
    trial.drive()
    trial.robot.kill()
    trial.robot = trial.host.node("robot.py", NAMESPACE, OUTPUT)
    trial.drive()
    trial.robot.kill()
    trial.end_boss()
    time.sleep(PARAMETERS["command_timeout"])
    trial.robot = trial.host.node("robot.py", NAMESPACE, OUTPUT)
    first = wait_until(trial.commands, "a velocity comes")[0]
    return {"first": first["v"]}


def latched(trial: Trial) -> Any:
    """A commander latched a command long ago; the gate is restarted: nothing may move."""
    began = time.monotonic()
    sender = trial.host.node("sender.py", "/boss", COMMAND, 0.1, 0.0, 0)
    wait_until(lambda: any(one["v"] != ZERO for one in trial.commands(began)), "the robot drives")
    trial.stands(time.monotonic())
    trial.gate.process.send_signal(signal.SIGTERM)
    trial.ended()
    restarted = time.monotonic()
    trial.gate = trial.host.gate()
    wait_until(lambda: trial.commands(restarted), "the gate publishes")
    time.sleep(WATCHED)
    moved = [one for one in trial.commands(restarted) if one["v"] != ZERO]
    sender.kill()
    return {"moved": len(moved)}


def bypass(trial: Trial) -> Any:
    rival = trial.host.node("sender.py", "/rival", OUTPUT, 0.0, 0.0)
    past = trial.host.node("robot.py", f"{NAMESPACE}/vendor", COMMAND)
    rivals, bypassing = trial.report("/rival publishes"), trial.report("takes commands past the gate")
    rival.kill()
    past.kill()
    return {"rival": rivals["level"], "past": bypassing["message"]}


def terminated(trial: Trial) -> Any:
    trial.drive()
    began = time.monotonic()
    trial.gate.process.send_signal(signal.SIGTERM)
    return {"stands": trial.stands(began), "status": trial.ended()}


def killed(trial: Trial) -> Any:
    """As systemd does: `send_zero.py` at once, the gate again a second later."""
    trial.drive()
    began = time.monotonic()
    trial.gate.kill()
    status, output = trial.host.send_zero()
    trial.end_boss()
    return {"stands": trial.stands(began), "status": status, "output": output}


def killed_and_restarted(trial: Trial) -> Any:
    """The worst case: only the restarted gate stops the robot."""
    trial.drive()
    trial.end_boss()
    began = time.monotonic()
    trial.gate.kill()
    trial.gate = trial.host.gate()
    return {"stands": trial.stands(began)}


def shut_down(trial: Trial) -> Any:
    """Anybody asks it to end, as `rosnode kill` does; it obeys its commander, as before."""
    trial.drive()
    xmlrpc.client.ServerProxy(_gate_uri()).shutdown("/test", "rosnode kill")
    return _goes_on(trial)


def replaced(trial: Trial) -> Any:
    """Another node takes the gate's name, and publishes elsewhere."""
    trial.drive()
    uri = _gate_uri()
    before = _registered(f"{NAMESPACE}/gate")
    thief = trial.host.node("sender.py", f"{NAMESPACE}/gate", "/elsewhere", 0.1, 0.0)
    wait_until(lambda: _gate_uri() != uri, "the name is taken")
    wait_until(lambda: _gate_uri() == uri, "the gate takes its name back")
    thief.kill()
    after = _registered(f"{NAMESPACE}/gate")
    return {**_goes_on(trial), "before": before, "after": after}


def crowded(trial: Trial) -> Any:
    """A stranger holds more connections to each server than a process may have files."""
    trial.drive()
    api = xmlrpc.client.ServerProxy(_gate_uri())
    topics = api.requestTopic("/test", OUTPUT, [["TCPROS"]])[2]
    ports = (urlsplit(_gate_uri()).port, topics[2])
    crowds = [trial.host.node("crowd.py", "127.0.0.1", port, CROWD) for port in ports]
    for one in crowds:
        wait_until(lambda one=one: one.lines, "the connections are open")
    files = len(list(Path(f"/proc/{trial.gate.process.pid}/fd").iterdir()))
    trial.robot.kill()  # a new subscriber comes
    trial.robot = trial.host.node("robot.py", NAMESPACE, OUTPUT)
    found = _goes_on(trial)
    for one in crowds:
        one.kill()
    return {**found, "files": files}


def _goes_on(trial: Trial) -> Any:
    """A commander that comes now drives the robot, and the robot stands once it ends."""
    trial.end_boss()
    trial.drive()
    began = time.monotonic()
    trial.end_boss()
    return {"stands": trial.stands(began), "ended": trial.gate.process.poll()}


def _gate_uri() -> str:
    return str(xmlrpc.client.ServerProxy(URI).lookupNode("/test", f"{NAMESPACE}/gate")[2])


def _registered(node: str) -> list[list[str]]:
    """The topics that the master has of a node: published, subscribed; and its services."""
    sides: Any = xmlrpc.client.ServerProxy(URI).getSystemState("/test")[2]
    return [sorted(topic for topic, nodes in side if node in nodes) for side in sides]


def master_killed(trial: Trial) -> Any:
    """The gate goes on, also with its dead-man; it ends once a new master does not know it."""
    trial.drive()
    trial.host.master.kill()
    trial.host.master.wait()
    began = time.monotonic()
    trial.end_boss()
    stands = trial.stands(began)
    trial.host.start_master()
    return {"stands": stands, "status": trial.ended()}


#: The last faults leave no gate: it is started again after each.
LASTING = (
    *(publisher_killed, stranger, not_a_number, too_fast, flooded, commander_stopped),
    *(driver_restarted, latched, bypass, crowded, shut_down, replaced),
)
ENDING = (terminated, killed, killed_and_restarted, master_killed)


def main() -> None:
    trial = Trial(Path(sys.argv[1]))
    figures = {}
    for fault in (*LASTING, *ENDING):
        if trial.gate.process.poll() is not None:
            trial.gate = trial.host.gate()
        figures[fault.__name__] = {**fault(trial), "lost": trial.lost}
        if fault in ENDING:
            trial.end_boss()
        trial.host.unregister_killed()
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
