"""The attacks, and how each is judged by what is true before and after it."""

from __future__ import annotations

import json
import signal
import subprocess
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from typing import Any

from tests.attacks.intruder import ELSEWHERE
from tests.attacks.positions import Position, printed
from tests.attacks.table import Attack, Verdict, judged
from tests.attacks.world import HOST, PROOF, ROBOT, Observer, World
from tests.e2e.dead_man import Page, signalled
from tests.e2e.lab_swarm import HOME, LEADER, SOURCE, SWARM, LabSwarm, moves
from tests.e2e.ros_addresses import ros_addresses
from tests.timing import PATIENCE, wait_for, withheld

ATTACKS = (
    Attack("list_graph", "list the graph", reads=True),
    Attack("read_odometry", "read the odometry", reads=True),
    Attack("publish_as_stranger", "drive, under a name of its own"),
    Attack("publish_as_commander", "drive, under a commander's name"),
    Attack("publish_in_namespace", "drive, as a node inside /k3"),
    Attack("made_up_node", "drive, as a made-up node at the commander's host"),
    Attack("forged_update", "drive, by a forged publisherUpdate at the driver"),
    Attack("squat_at_restart", "drive, at the master's port as its unit restarts", squats=True),
    Attack("squat_at_crash", "drive, at the master's port as it crashes", squats=True),
    Attack("squat_at_boot", "drive, at the master's port as its host boots", squats=True),
    Attack("squat_commander", "drive, at the port of a commander that was killed", squats=True),
    Attack("squat_driver", "send odometry, at the port of a driver that was killed", squats=True),
    Attack("set_lights", "set the lights"),
    Attack("kick_out", "register the driver's name elsewhere", commanded=True),
    Attack("shut_down_driver", "shutdown at the driver", commanded=True),
    Attack("shut_down_master", "shutdown at the master", commanded=True),
    Attack("unregister_odometry", "unregister the driver's odometry"),
    Attack("unregister_commander", "unregister the commander's topic", commanded=True),
    Attack("set_run_id", "set /run_id"),
    Attack("set_parameter", "set a parameter of the driver"),
    Attack("delete_parameter", "delete a parameter of the robot"),
    Attack("dead_publishers", "register 2 000 dead publishers", commanded=True),
    Attack("flood_master", "1 300 connections to the master for 10 s"),
    Attack("flood_driver", "1 300 connections to the driver for 10 s", commanded=True),
    Attack("log_in", "SSH with a key of its own"),
    Attack("tamper", "change files of the release and its state", local=True),
    Attack("hold_lock", "hold the lock of deploys", local=True),
)
_GOES = 0.002  # m that a robot goes at least if it is driven
_EQUAL = 0.02  # m
_SPEED = 0.1  # m/s
_AFTERWARDS = 1.0  # s for which a commander drives on after the attack
_SOON = 10.0  # s within which a robot obeys a new commander, whose program starts meanwhile
_MASTER, _KOALA = f"swarm-{SWARM}.master", f"swarm-{SWARM}.koala"
#: What frees the port of the master.
_FREES = {
    "squat_at_restart": f"sudo systemctl restart --no-block {_MASTER}",
    "squat_at_crash": f"sudo systemctl kill --signal=KILL {_MASTER}",
}
_FAULT = "publisher killed"  # in docs/dead-man.md


@dataclass(frozen=True)
class Scene:
    """One attack: the world before and after, what the attacker has printed, and what was seen meanwhile.

    ``place``: x and y (m) of the odometry that a declared host reads.
    ``stood``: the robot stood at some time although a commander drove it; ``obeys``: it obeys that one to the
    end, and the next one.
    ``late``: it stood later than the dead-man promises, once the commander was killed.
    """

    before: World
    after: World
    printed: Mapping[str, Any]
    place: tuple[float, ...] = ()
    master_answered: bool = True
    stood: bool = False
    obeys: bool = True
    late: bool = False
    lock_was_free: bool = True
    logged_in: bool = False
    files_changed: bool = False

    @property
    def read(self) -> Any:
        return self.printed.get("read")

    @property
    def harm(self) -> str:
        """What has become of the robot, in words; empty if it obeys its commander, and stands, as before."""
        unit = f"{HOST}:{ROBOT}"
        if self.before.pids[unit] != self.after.pids[unit]:
            return "another process drives the robot"
        if not self.obeys:
            return "the robot obeys its commander, or the next one, no more"
        return "the robot stood too late" if self.late else ""


def _read_nodes(scene: Scene) -> Verdict:
    return _whether("/k3/driver" in json.dumps(scene.read))


def _read_place(scene: Scene) -> Verdict:
    places = zip(scene.read or (), scene.place, strict=False)
    return _whether(bool(scene.read) and all(abs(one - other) < _EQUAL for one, other in places))


def _moved(scene: Scene) -> Verdict:
    return _whether(scene.after.robot["distance"] > scene.before.robot["distance"] + _GOES)


def _squatted(scene: Scene) -> Verdict:
    if _moved(scene) is Verdict.SUCCEEDS:
        return Verdict.SUCCEEDS
    return _whether(bool(scene.read), Verdict.PARTLY)


def _lit(scene: Scene) -> Verdict:
    return _whether(scene.after.robot["lights"] != scene.before.robot["lights"])


def _harmed(scene: Scene) -> Verdict:
    if scene.harm:
        return Verdict.SUCCEEDS
    lists = [
        key for key in ("publishers", "driver") if _lasting(scene.before, key) != _lasting(scene.after, key)
    ]
    return Verdict.PARTLY if scene.stood or lists else Verdict.REFUSED


def _lasting(world: World, key: str) -> Any:
    """Without commanders: each is another node."""
    if key == "driver":
        return world.graph[key]
    return [one for one in world.graph[key] if not one[1].startswith("/rostopic")]


def _lost_commander(scene: Scene) -> Verdict:
    if scene.harm:
        return Verdict.SUCCEEDS
    return _whether(not scene.after.graph["commanders"], Verdict.PARTLY)


def _lost_odometry(scene: Scene) -> Verdict:
    return _whether(not scene.after.publishes("/k3/odom", "/k3/driver"))


def _ended_master(scene: Scene) -> Verdict:
    return _whether(scene.before.graph["pid"] != scene.after.graph["pid"])


def _changed_parameters(scene: Scene) -> Verdict:
    return _whether(scene.before.graph["parameters"] != scene.after.graph["parameters"])


def _shut_out(scene: Scene) -> Verdict:
    return _whether(not scene.master_answered or _ended_master(scene) is Verdict.SUCCEEDS)


def _whether(succeeds: bool, then: Verdict = Verdict.SUCCEEDS) -> Verdict:
    return then if succeeds else Verdict.REFUSED


JUDGES: Mapping[str, Callable[[Scene], Verdict]] = {
    "list_graph": _read_nodes,
    "read_odometry": _read_place,
    "set_lights": _lit,
    "shut_down_master": _ended_master,
    "unregister_odometry": _lost_odometry,
    "unregister_commander": _lost_commander,
    "flood_master": _shut_out,
    "squat_driver": lambda scene: _whether(scene.read == ELSEWHERE),
    "log_in": lambda scene: _whether(scene.logged_in),
    "tamper": lambda scene: _whether(scene.files_changed),
    "hold_lock": lambda scene: _whether(not scene.lock_was_free),
    **dict.fromkeys(("set_run_id", "set_parameter", "delete_parameter"), _changed_parameters),
    **dict.fromkeys(("kick_out", "shut_down_driver", "dead_publishers", "flood_driver"), _harmed),
    **dict.fromkeys(
        (
            "publish_as_stranger",
            "publish_as_commander",
            "publish_in_namespace",
            "made_up_node",
            "forged_update",
            "squat_commander",
        ),
        _moved,
    ),
    **dict.fromkeys(("squat_at_restart", "squat_at_crash", "squat_at_boot"), _squatted),
}


def carried_out(observer: Observer, attack: Attack, position: Position) -> tuple[Verdict, str]:
    """What an attack from a position achieves in a swarm that is whole, and the error that the attacker met,
    or the harm that is done.

    The swarm is as the attack leaves it.
    """
    of_kind = _squats if attack.squats else _commanded if attack.commanded else _calm
    scene = of_kind(observer, attack, position)
    harm = "" if attack.squats else scene.harm  # what frees a port restarts drivers
    return judged(attack, position.key, JUDGES[attack.call](scene)), scene.printed.get("error", harm)


def _facts(observer: Observer, world: World, topics: int) -> Mapping[str, Any]:
    hosts = ros_addresses(observer.swarm)
    return {
        "master": observer.master,
        "driver": world.graph["driver"],
        "topics": [hosts[HOST], topics],
        "host": hosts[HOST],
        "leader": hosts[LEADER],
        "commander": "/koala/driver",
        "commanders": world.graph["commanders"],
        "squatted": world.graph["squatted"],
        "light": 1 - world.robot["lights"]["led0"],
        "home": HOME,
        "proof": PROOF,
    }


def _calm(observer: Observer, attack: Attack, position: Position) -> Scene:
    observer.swarm.seconds_to_standstill(ROBOT)
    before, host = observer.look(), position.host
    files = observer.files(host) if attack.local and host else ""
    place = observer.place() if attack.call == "read_odometry" else ()
    answered = free = True
    with position.begin(
        observer.swarm, attack.call, _facts(observer, before, observer.topics(before))
    ) as process:
        assert process.stdout is not None
        first = process.stdout.readline()
        if first == "on\n":
            free = host is None or observer.lock_is_free(host)
            while process.poll() is None:
                answered = observer.master_answers() and answered
        found = _end(process, first)
    return Scene(
        before,
        observer.look(),
        found,
        place,
        master_answered=answered,
        lock_was_free=free,
        logged_in=observer.logged_in(),
        files_changed=bool(files) and host is not None and observer.files(host) != files,
    )


def _squats(observer: Observer, attack: Attack, position: Position) -> Scene:
    """The attacker waits for a port, which is then freed."""
    swarm = observer.swarm
    with ExitStack() as open_:
        if attack.call == "squat_commander":
            commander = open_.enter_context(swarm.publishing(LEADER, ROBOT, 0.0))
            wait_for(lambda: observer.look().graph["commanders"], complaint="no commander registers")
        before = observer.look()
        facts = _facts(observer, before, 0)
        if attack.call == "squat_at_boot":
            with position.at_boot(swarm, attack.call, facts):
                swarm.reboot(LEADER)
                found = wait_for(lambda: position.result(swarm), complaint="the attacker does not end")
                return Scene(before, observer.look(), found or {})
        process = open_.enter_context(position.begin(swarm, attack.call, facts))
        assert process.stdout is not None
        first = process.stdout.readline()
        if attack.call == "squat_driver":
            return Scene(before, observer.look(), {"read": _received(swarm)})
        if attack.call == "squat_commander":
            commander.kill()
            swarm.shell(HOST, f"sudo systemctl restart swarm-{SWARM}.{ROBOT}")
        else:
            swarm.shell(LEADER, _FREES[attack.call])
        found = _end(process, first)
        return Scene(before, observer.look(), found)


def _received(swarm: LabSwarm) -> float | None:
    """Where the Koala is for another host, after its driver was killed; None if nobody sends that."""
    swarm.shell(LEADER, f"sudo systemctl kill --signal=KILL {_KOALA}; sudo systemctl stop {_KOALA}")
    try:
        listen = "timeout 8 rostopic echo -n 1 -p /koala/odom/pose/pose/position/x || true"
        lines = swarm.shell(HOST, f"{SOURCE}; {listen}").splitlines()
    finally:
        swarm.shell(LEADER, f"sudo systemctl start {_KOALA}")
    return float(lines[-1].rpartition(",")[2]) if len(lines) > 1 else None


def _commanded(observer: Observer, attack: Attack, position: Position) -> Scene:
    swarm = observer.swarm
    swarm.seconds_to_standstill(ROBOT)  # the commander of another attack has driven it
    with swarm.publishing(LEADER, ROBOT, _SPEED):
        wait_for(lambda: moves(swarm.robot(ROBOT)), complaint="the robot does not obey its commander")
        before = observer.look()
        looks = []
        facts = _facts(observer, before, observer.topics(before))
        with position.begin(swarm, attack.call, facts) as process:
            while process.poll() is None:
                looks.append(moves(swarm.robot(ROBOT)))
                time.sleep(0.01)
            found = _end(process, "")
        end = time.monotonic() + _AFTERWARDS
        while time.monotonic() < end:
            looks.append(moves(swarm.robot(ROBOT)))
            time.sleep(0.01)
        after = observer.look()
        waited = withheld()
        killed = signalled(swarm, LEADER, signal.SIGKILL, "/k3/cmd_vel")
        wait_for(lambda: not moves(swarm.robot(ROBOT)), complaint="the robot does not stand")
        late = time.monotonic() - killed - (withheld() - waited) > Page().bound(_FAULT)
    obeys = looks[-1] and _obeys_another(observer)
    return Scene(before, after, found, stood=not all(looks), obeys=obeys, late=late)


def _obeys_another(observer: Observer) -> bool:
    """Whether the robot obeys a commander that comes after the attack."""
    swarm = observer.swarm
    with suppress(AssertionError), swarm.publishing(LEADER, ROBOT, _SPEED):
        wait_for(lambda: moves(swarm.robot(ROBOT)), _SOON)
        return True
    return False


def _end(process: subprocess.Popen[str], begun: str) -> Mapping[str, Any]:
    """What the attacker prints at its end."""
    return printed(begun + process.communicate(timeout=PATIENCE)[0])
