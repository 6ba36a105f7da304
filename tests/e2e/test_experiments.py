"""``swarmctl run`` on real hosts: robots start together and stop, whoever fails, and trials are kept."""

from __future__ import annotations

import json
import math
import os
import re
import shutil
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from swarm_onboard.agent import hardware

from swarmctl.capsule import folder as capsules
from swarmctl.cli import exit_codes
from swarmctl.lab import lab
from swarmctl.render.build_bundle import bundles
from tests.e2e.bags import FOLDER, forget, messages
from tests.e2e.experiment import EXAMPLES
from tests.e2e.lab_swarm import LabSwarm, Note, moves, until
from tests.loading import load_swarm
from tests.timing import PATIENCE

CONTROL = "  - {by: koala-laptop, of: [koala, k3, epuck]}\n"
EXPERIMENT = """
programs:
  ahead-koala:
    host: koala-laptop
    command: [rostopic, pub, -r, "10", /koala/cmd_vel, geometry_msgs/Twist, "{{linear: {{x: 0.05}}}}"]
  ahead-k3:
    host: koala-laptop
    command: [rostopic, pub, -r, "10", /k3/cmd_vel, geometry_msgs/Twist, "{{linear: {{x: 0.05}}}}"]
    lifecycle: trial

experiments:
  ahead:
    programs: [ahead-koala, ahead-k3]
    duration: %s
    trials: 2
    record: ["*/odom"]
"""
RESET = """
  back:
    host: koala-laptop
    command:
      - bash
      - -c
      - "timeout 4 rostopic pub -r 10 /k3/cmd_vel geometry_msgs/Twist '{{linear: {{x: -0.05}}}}' || true"
    lifecycle: trial
"""
IN_TRIALS = "swarm-newswarm.ahead-k3"
DRIVEN = ("koala", "k3")
VARIED = """
packages:
  simple_moves: {from: ./simple_moves}

programs:
  square:
    host: koala-laptop
    package: simple_moves
    executable: square.py
    params: {speed: 0.01, side: 1.0}
    remap: {cmd_vel: /k3/cmd_vel}
    publishes: [{topic: /k3/cmd_vel, type: geometry_msgs/Twist, rate: 10.0}]

experiments:
  squares:
    robots: [k3]
    programs: [square]
    duration: 6
    record: [/k3/odom]
    parameters: {square: {speed: [0.02, 0.1]}}
    ready: {battery: 0.1, clocks: 1.0}
    success: [{topic: k3/odom, distance: 0.2}]
  empty: {duration: 5, ready: {battery: 1.0}}
"""


@pytest.fixture(autouse=True)
def _clean(swarm: LabSwarm) -> Iterator[None]:
    yield
    assert swarm.deploy(None, "--stop-robots").status == exit_codes.OK
    swarm.swarmctl("stop")
    forget(swarm)
    swarm.swarmctl("start")


def deployed(swarm: LabSwarm, seconds: float) -> Path:
    """The spec of an experiment with trials of so many seconds, deployed, its robots stopped."""
    text = CONTROL + EXPERIMENT % seconds
    spec = swarm.variant(f"ahead-{seconds:g}", (CONTROL, text))
    assert swarm.deploy(spec).status == exit_codes.OK
    swarm.swarmctl("stop", spec=spec)
    until(lambda: stand(swarm), "a robot does not stop")
    return spec


def drive(swarm: LabSwarm) -> bool:
    robots = swarm.robots()
    return all(moves(robots[one]) for one in DRIVEN)


def stand(swarm: LabSwarm) -> bool:
    return not any(map(moves, swarm.robots().values()))


def running_in_trials(swarm: LabSwarm) -> bool:
    state = swarm.shell("koala-laptop", f"systemctl is-active {IN_TRIALS} || true")
    return state.strip() != "inactive"


def test_trials_start_together_and_are_kept(swarm: LabSwarm, tmp_path: Path, note: Note) -> None:
    spec = deployed(swarm, 5)
    run = swarm.swarmctl("run", "ahead", "--out", str(tmp_path), "--json", spec=spec)
    assert run.status == exit_codes.OK, run.err
    trials = run.json()["trials"]
    assert [(one["trial"], one["outcome"]) for one in trials] == [(1, "completed"), (2, "completed")]
    assert stand(swarm)
    for one in trials:
        folder = Path(one["capsule"])
        index = capsules.read(folder)
        assert not capsules.problems(folder)
        assert index.skew is not None
        note("between the first and the last host's start", f"{index.skew * 1e3:.1f} ms", "-")
        assert {name: robot.state for name, robot in index.robots.items()} == dict.fromkeys(
            swarm.robots(), "stands"
        )
        assert (folder / index.spec[0]).read_text("utf-8") == spec.read_text("utf-8")
        (bag,) = [bag for bag in folder.glob("bags/*.bag") if "k3-pi" in bag.name]
        way = [message.pose.pose.position.x for _, _, message in messages(bag, "/k3/odom")]
        assert way[0] < way[-1], "the bag begins before the robot moves, and has its way"
        assert json.loads((folder / "status-after.json").read_text("utf-8"))["healthy"]
        assert {log.stem for log in folder.glob("logs/*.log")} == set(swarm.hosts)
        commands = json.loads((folder / "commands.json").read_text("utf-8"))
        assert {one["robot"] for one in commands if one["event"] == "commanded"} == set(DRIVEN)
        costs = json.loads((folder / "costs.json").read_text("utf-8"))
        (driver,) = (one for one in costs["k3-pi"] if one["name"] == "k3")
        assert driver["memory"] > 0
        assert driver["cpu"] > 0
        log = (folder / "logs/k3-pi.log").read_text("utf-8")
        assert [line for line in log.splitlines() if re.match(r"\S+Z k3 +\w+ +\S", line)], "of the driver"
        assert all(host.python and "-ros-" in host.platform for host in index.hosts.values()), index.hosts
        systems = {(host.kernel, host.model) for host in index.hosts.values()}
        here = os.uname()
        assert systems == {(f"{here.release} {here.version}", hardware.model(str))}, (
            "a lab's are this machine's"
        )
        assert all(robot.port for robot in index.robots.values()), index.robots
        assert (index.robots["k3"].firmware, index.robots["koala"].firmware) == ("2,1", "5.00,1.00")
    verified = swarm.run("capsule", "verify", *(one["capsule"] for one in trials))
    assert verified.status == exit_codes.OK, verified.out


def test_a_trial_ends_by_a_topic_and_a_program_brings_robots_back(swarm: LabSwarm, tmp_path: Path) -> None:
    ends = "    reset: back\n    until: [{topic: k3/odom, distance: 0.15}]\n"
    text = (EXPERIMENT % 60).replace("    trials: 2\n", f"    trials: 2\n{ends}")
    spec = swarm.variant(
        "back", (CONTROL, CONTROL + text.replace("\nexperiments:", f"{RESET}\nexperiments:"))
    )
    assert swarm.deploy(spec).status == exit_codes.OK
    run = swarm.swarmctl("run", "ahead", "--out", str(tmp_path), "--json", spec=spec)
    assert run.status == exit_codes.OK, run.err
    assert stand(swarm)
    ways = []
    for one in run.json()["trials"]:
        (bag,) = Path(one["capsule"]).glob("bags/k3-pi*.bag")
        index = capsules.read(Path(one["capsule"]))
        assert index.ended - index.began < index.seconds, "it does not wait for its time"
        poses = [message.pose.pose.position for _, _, message in messages(bag, "/k3/odom")]
        ways.append([(one.x, one.y) for one in poses])
    first, second = ways
    assert math.dist(first[0], first[-1]) >= 0.15, "ahead"
    assert math.dist(first[0], second[0]) < 0.15, "and back, before the second trial"
    assert math.dist(second[0], second[-1]) >= 0.15, "and ahead again"


def test_a_program_of_trials_runs_in_trials_alone(swarm: LabSwarm, tmp_path: Path) -> None:
    spec = deployed(swarm, 30)
    swarm.swarmctl("start", spec=spec)
    until(lambda: moves(swarm.robots()["koala"]), "the other program does not run")
    assert not moves(swarm.robots()["k3"])
    assert swarm.swarmctl("status", spec=spec).status == exit_codes.OK
    running = swarm.begin("run", "ahead", "--trial", "1", "--out", str(tmp_path), "--json", spec=spec)
    until(lambda: drive(swarm), "the trial does not begin")
    swarm.shell("koala-laptop", f"sudo systemctl kill --signal=KILL {IN_TRIALS}")
    out, err = running.communicate(timeout=PATIENCE)
    assert running.returncode == exit_codes.UNHEALTHY, err
    (trial,) = json.loads(out)["trials"]
    assert (trial["outcome"], trial["cause"]) == (
        "failed",
        f"{IN_TRIALS}.service on koala-laptop failed: signal",
    )
    index = capsules.read(Path(trial["capsule"]))
    assert index.ended - index.began < index.seconds, "it does not wait for the end"
    assert "in its last trial it failed" in swarm.swarmctl("status", spec=spec).out
    assert swarm.swarmctl("ready", "ahead", spec=spec).status == exit_codes.OK, "the next one may begin"


def test_each_combination_of_parameters_has_a_trial_that_is_judged(swarm: LabSwarm, tmp_path: Path) -> None:
    shutil.copytree(EXAMPLES / "paper-3-central/simple_moves", swarm.folder / "simple_moves")
    spec = swarm.variant("squares", (CONTROL, CONTROL + VARIED))
    assert swarm.deploy(spec).status == exit_codes.OK

    def ready() -> bool:  # a driver reads its battery once in a second
        return swarm.swarmctl("ready", "squares", spec=spec).status == exit_codes.OK

    until(ready, "the swarm is not ready")
    refused = swarm.swarmctl("run", "empty", "--out", str(tmp_path), spec=spec)
    assert refused.status == exit_codes.UNHEALTHY
    assert re.search(r"trial 1 did not begin: batteries: .*less than 100%", refused.err), refused.err
    run = swarm.swarmctl("run", "squares", "--out", str(tmp_path), "--json", spec=spec)
    assert run.status == exit_codes.UNHEALTHY, "one of them is too slow"
    slow, fast = (capsules.read(Path(one["capsule"])) for one in run.json()["trials"])
    assert (slow.parameters, fast.parameters) == ({"square": {"speed": 0.02}}, {"square": {"speed": 0.1}})
    assert (slow.outcome, slow.success, fast.outcome, fast.success) == ("completed", False, "completed", True)
    for one, trial in zip((slow, fast), run.json()["trials"], strict=True):
        again, _ = load_swarm(*(Path(trial["capsule"], file) for file in one.spec))
        assert again is not None
        assert {host: bundle.digest for host, bundle in bundles(again).items()} == {
            host: seen.release for host, seen in one.hosts.items()
        }
    for one, least, most in ((slow, 0.05, 0.15), (fast, 0.2, 0.7)):
        assert least <= (one.judged[0].found or 0) <= most
        assert {name for name, host in one.hosts.items() if host.clock} == {"koala-laptop", "k3-pi"}
    assert slow.hosts["koala-laptop"].release != fast.hosts["koala-laptop"].release
    assert swarm.swarmctl("plan", "--detailed-exitcode", spec=spec).status == exit_codes.OK, (
        "hosts have the spec's own"
    )
    kept = run.json()["trials"][1]["capsule"]
    again = swarm.swarmctl("run", "--replay", kept, "--out", str(tmp_path / "again"), "--json", spec=spec)
    assert again.status == exit_codes.OK, again.err
    replayed = capsules.read(Path(again.json()["trials"][0]["capsule"]))
    assert (replayed.trial, replayed.parameters, replayed.success) == (2, fast.parameters, True)
    assert [one.release for one in replayed.hosts.values()] == [one.release for one in fast.hosts.values()]


def test_no_trial_begins_with_a_low_battery(swarm: LabSwarm, tmp_path: Path) -> None:
    spec = limited(swarm, EXPERIMENT % 15)
    until(lambda: ready(swarm, spec), "the swarm is not ready")
    running = swarm.begin("run", "ahead", "--out", str(tmp_path), spec=spec)
    until(lambda: drive(swarm), "the trial does not begin")
    lab.fault(swarm.name, "battery", "k3", 30.0)
    try:
        out, err = running.communicate(timeout=PATIENCE)
    finally:
        lab.fault(swarm.name, "battery", "k3", 80.0)
    assert "trial 1  completed" in out
    assert running.returncode == exit_codes.UNHEALTHY
    assert re.search(r"trial 2 did not begin: batteries: k3 \d+% \(less than 40%\)", err), err
    until(lambda: ready(swarm, spec), "the swarm is not ready again")


def test_a_robot_with_an_empty_battery_stands_until_it_is_charged(swarm: LabSwarm) -> None:
    spec = limited(swarm, "")

    def driven() -> bool:
        return moves(swarm.robots()["k3"])

    with swarm.driving("koala-laptop", "k3", 0.05):
        until(driven, "it does not drive")
        lab.fault(swarm.name, "battery", "k3", 5.0)
        try:
            until(lambda: not driven(), "it drives on")
            until(lambda: "report k3" in swarm.findings(spec=spec), "status does not name it")
            found = swarm.findings(spec=spec)["report k3"]
            assert re.search(r"battery empty: \d+%, takes no command until 40%", found["message"]), found
            refused = swarm.swarmctl("ready", spec=spec)
            assert refused.status == exit_codes.UNHEALTHY
            assert re.search(r"batteries +NO-GO +k3 \d+% \(less than 40%\)", refused.out), refused.out
            assert not driven(), "whoever commands it"
        finally:
            lab.fault(swarm.name, "battery", "k3", 50.0)
        until(driven, "it takes no command with a charged battery")
    until(lambda: ready(swarm, spec), "the swarm is not ready again")


def limited(swarm: LabSwarm, text: str) -> Path:
    """The spec, deployed, with limits for the battery of k3, and ``text``."""
    k3 = "k3: {type: khepera3, host: k3-pi"
    limits = f"{k3}, settings: {{battery: {{low: 0.4, empty: 0.2}}}}"
    spec = swarm.variant("batteries", (k3, limits), (CONTROL, CONTROL + text))
    assert swarm.deploy(spec).status == exit_codes.OK
    return spec


def ready(swarm: LabSwarm, spec: Path) -> bool:
    return swarm.swarmctl("ready", spec=spec).status == exit_codes.OK


def test_robots_stop_when_the_operator_is_gone(swarm: LabSwarm, tmp_path: Path) -> None:
    spec = deployed(swarm, 8)
    running = swarm.begin("run", "ahead", "--out", str(tmp_path), spec=spec)
    try:
        until(lambda: drive(swarm), "the trial does not begin")
    finally:
        running.kill()
        running.communicate()
    assert drive(swarm), "nobody but the hosts stops them"
    until(lambda: stand(swarm), "the robots drive on without their operator")
    until(lambda: not running_in_trials(swarm), "a program of trials runs on")
    assert "stopped by" in swarm.swarmctl("status", spec=spec).out
    again = swarm.swarmctl("run", "ahead", "--out", str(tmp_path), spec=spec)
    assert again.status == exit_codes.UNHEALTHY
    assert "record" in again.err
    assert "--fetch` fetches them" in again.err, "bags of one trial are in no other's capsule"


def test_ctrl_c_stops_robots_and_the_rest_is_resumed(swarm: LabSwarm, tmp_path: Path) -> None:
    spec = deployed(swarm, 8)
    running = swarm.begin("run", "ahead", "--out", str(tmp_path), "--json", spec=spec)
    until(lambda: drive(swarm), "the trial does not begin")
    running.send_signal(signal.SIGINT)
    out, err = running.communicate(timeout=PATIENCE)
    assert running.returncode == exit_codes.INTERRUPTED, err
    assert stand(swarm)
    (trial,) = json.loads(out)["trials"]
    index = capsules.read(Path(trial["capsule"]))
    assert (index.trial, index.outcome) == (1, "interrupted")
    assert [path for path in index.files if path.startswith("bags/")]
    resumed = swarm.swarmctl("run", "ahead", "--resume", "--out", str(tmp_path), "--json", spec=spec)
    assert [one["trial"] for one in resumed.json()["trials"]] == [1, 2], resumed.err
    again = swarm.swarmctl("run", "ahead", "--resume", "--out", str(tmp_path), "--json", spec=spec)
    assert (again.status, again.json()["trials"]) == (exit_codes.OK, [])


def test_a_driver_that_ends_makes_a_trial_fail(swarm: LabSwarm, tmp_path: Path) -> None:
    spec = deployed(swarm, 8)
    running = swarm.begin("run", "ahead", "--trial", "2", "--out", str(tmp_path), "--json", spec=spec)
    until(lambda: drive(swarm), "the trial does not begin")
    swarm.shell("k3-pi", "sudo systemctl kill --signal=KILL swarm-newswarm.k3")
    out, err = running.communicate(timeout=PATIENCE)
    assert running.returncode == exit_codes.UNHEALTHY, err
    (trial,) = json.loads(out)["trials"]
    assert (trial["trial"], trial["outcome"]) == (2, "failed")
    assert trial["cause"] == "the driver of k3 ended in the trial, and was started again"


def test_a_recording_that_ends_makes_a_trial_fail(swarm: LabSwarm, tmp_path: Path) -> None:
    spec = deployed(swarm, 8)
    running = swarm.begin("run", "ahead", "--trial", "1", "--out", str(tmp_path), "--json", spec=spec)
    until(lambda: drive(swarm), "the trial does not begin")
    swarm.shell("k3-pi", "sudo systemctl kill --signal=KILL 'swarm-recording@*'")
    out, err = running.communicate(timeout=PATIENCE)
    assert running.returncode == exit_codes.UNHEALTHY, err
    (trial,) = json.loads(out)["trials"]
    assert trial["outcome"] == "failed"
    assert trial["cause"].startswith("the recording on k3-pi: ")


def test_a_full_disk_makes_a_trial_fail(swarm: LabSwarm, tmp_path: Path) -> None:
    spec = deployed(swarm, 8)
    swarm.shell("k3-pi", f"sudo mkdir -p {FOLDER} && sudo mount -t tmpfs -o size=64M bags {FOLDER}")
    try:
        running = swarm.begin("run", "ahead", "--trial", "1", "--out", str(tmp_path), "--json", spec=spec)
        until(lambda: drive(swarm), "the trial does not begin")
        swarm.shell("k3-pi", f"sudo fallocate -l 60M {FOLDER}/filler")
        out, err = running.communicate(timeout=PATIENCE)
    finally:
        swarm.shell("k3-pi", f"sudo umount -l {FOLDER}")
    assert running.returncode == exit_codes.UNHEALTHY, err
    (trial,) = json.loads(out)["trials"]
    assert (trial["outcome"], trial["cause"]) == ("failed", "the recording on k3-pi: ended: disk")
    assert stand(swarm)
    index = capsules.read(Path(trial["capsule"]))
    assert [path for path in index.files if path.startswith("bags/k3-pi")], "what fitted is kept"


def test_a_robot_that_is_unplugged_makes_a_trial_fail(swarm: LabSwarm, tmp_path: Path) -> None:
    spec = deployed(swarm, 8)
    running = swarm.begin("run", "ahead", "--trial", "1", "--out", str(tmp_path), "--json", spec=spec)
    until(lambda: drive(swarm), "the trial does not begin")
    lab.unplug(swarm.name, "k3")
    try:
        out, err = running.communicate(timeout=PATIENCE)
    finally:
        lab.plug(swarm.name, "k3")
    assert running.returncode == exit_codes.UNHEALTHY, err
    (trial,) = json.loads(out)["trials"]
    assert trial["outcome"] == "failed"
    assert "k3" in trial["cause"]
    until(lambda: stand(swarm), "a robot drives on")


def test_a_host_that_is_cut_off_stops_its_robots(swarm: LabSwarm, tmp_path: Path) -> None:
    spec = deployed(swarm, 8)
    running = swarm.begin("run", "ahead", "--trial", "1", "--out", str(tmp_path), "--json", spec=spec)
    until(lambda: drive(swarm), "the trial does not begin")
    swarm.cut("epuck-pi")
    swarm.cut("k3-pi")
    try:
        until(lambda: stand(swarm), "a robot drives on without the network")
    finally:
        swarm.join("k3-pi")
        swarm.join("epuck-pi")
    out, err = running.communicate(timeout=PATIENCE)
    assert running.returncode == exit_codes.UNHEALTHY, err
    (trial,) = json.loads(out)["trials"]
    assert "-pi: " in trial["cause"]
    assert len(list(Path(trial["capsule"]).glob("bags/*.bag"))) == len(swarm.hosts)


def test_robots_of_a_host_that_boots_stand(swarm: LabSwarm, tmp_path: Path) -> None:
    spec = deployed(swarm, 40)
    running = swarm.begin("run", "ahead", "--trial", "1", "--out", str(tmp_path), "--json", spec=spec)
    until(lambda: drive(swarm), "the trial does not begin")
    swarm.reboot("k3-pi")
    out, err = running.communicate(timeout=PATIENCE)
    assert running.returncode == exit_codes.UNHEALTHY, err
    (trial,) = json.loads(out)["trials"]
    assert trial["cause"] == "k3 was stopped before the end, or k3-pi restarted"
    assert stand(swarm)


def test_a_trial_of_a_sick_swarm_does_not_begin(swarm: LabSwarm, tmp_path: Path) -> None:
    spec = deployed(swarm, 5)
    swarm.shell("k3-pi", "sudo systemctl stop swarm-newswarm.k3")
    run = swarm.swarmctl("run", "ahead", "--out", str(tmp_path), spec=spec)
    assert run.status == exit_codes.UNHEALTHY
    assert "trial 1 did not begin" in run.err
    assert "k3" in run.err
    assert stand(swarm)
    assert not list(tmp_path.rglob("index.json"))
