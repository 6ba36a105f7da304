"""``swarmctl stop`` and ``start``: robots that drive stand, whatever happens, until they are released."""

from __future__ import annotations

import re

from swarmctl.cli import exit_codes
from tests.e2e.lab_swarm import LEADER, LabSwarm, Note, moves, until

SPEED = 0.1  # m/s
ONE_ROBOT, ITS_HOST = "k3", "k3-pi"


def stopped(swarm: LabSwarm, *robots: str) -> tuple[int, dict[str, dict[str, object]]]:
    run = swarm.swarmctl("stop", *robots, "--json")
    return run.status, {one["robot"]: one for one in run.json()["robots"]}


def test_driving_robots_stand_until_they_are_released(swarm: LabSwarm, note: Note) -> None:
    robots = tuple(swarm.robots())
    with swarm.driving(LEADER, "koala", SPEED), swarm.driving(LEADER, ONE_ROBOT, SPEED):
        try:
            _, found = stopped(swarm)
            assert set(found) == set(robots)
            assert {one["state"] for one in found.values()} <= {"stands", "unproven"}, found
            until(lambda: stopped(swarm)[0] == exit_codes.OK, "the wheels are not confirmed to stand")
            assert not any(moves(one) for one in swarm.robots().values())
            assert str(found[ONE_ROBOT]["commander"]).startswith(LEADER)
            note("stop, from the start of the program", f"{found[ONE_ROBOT]['seconds']} s", "by the wheels")
            assert "stopped by `swarmctl stop`" in swarm.diagnosis(ITS_HOST, ONE_ROBOT)

            until(lambda: swarm.swarmctl("status").status == exit_codes.OK, "status fails")
            # Robots whose hosts stopped them within the same second share a line.
            lines = re.findall(r"^! stop (.+): stopped by ", swarm.swarmctl("status").out, re.MULTILINE)
            assert sorted(", ".join(lines).split(", ")) == sorted(robots)

            swarm.shell(ITS_HOST, f"sudo systemctl restart swarm-newswarm.{ONE_ROBOT}")
            place = swarm.robot(ONE_ROBOT)["distance"]
            again = stopped(swarm, ONE_ROBOT)[1]
            assert again[ONE_ROBOT]["state"] in ("stands", "unproven"), again
            assert swarm.robot(ONE_ROBOT)["distance"] == place

            before = swarm.pids()
            assert swarm.swarmctl("restart", ONE_ROBOT).status == exit_codes.OK  # stopped, it is not in use
            after = swarm.pids()
            changed = {name for name in after if after[name] != before.get(name)}
            assert changed == {f"{ITS_HOST}:{ONE_ROBOT}"}
            assert swarm.robot(ONE_ROBOT)["distance"] == place

            run = swarm.swarmctl("start", ONE_ROBOT, "--json")
            assert run.json()["released"] == [ONE_ROBOT]
            until(lambda: moves(swarm.robot(ONE_ROBOT)), "the robot does not obey after its release")
            refused = swarm.swarmctl("restart", ONE_ROBOT)
            assert refused.status == exit_codes.HOSTS_FAILED
            assert (
                f"{ONE_ROBOT} is commanded by {LEADER}" in refused.out
                or "not confirmed to stand" in refused.out
            )
            assert swarm.pids() == after
            assert not moves(swarm.robot("koala"))
        finally:
            assert swarm.swarmctl("start").status == exit_codes.OK


def test_a_stop_holds_after_a_reboot_and_without_a_master(swarm: LabSwarm) -> None:
    swarm.shell(LEADER, "sudo systemctl stop swarm-newswarm.master")
    try:
        until(
            lambda: stopped(swarm, ONE_ROBOT)[0] == exit_codes.OK,
            "the wheels are not confirmed to stand",
        )
    finally:
        swarm.shell(LEADER, "sudo systemctl start swarm-newswarm.master")
    try:
        swarm.reboot(ITS_HOST)
        with swarm.publishing(LEADER, ONE_ROBOT, SPEED):
            until(
                lambda: "stopped by `swarmctl stop`" in swarm.diagnosis(ITS_HOST, ONE_ROBOT),
                "the driver does not say that its robot is stopped",
            )
            assert not moves(swarm.robot(ONE_ROBOT))
    finally:
        assert swarm.swarmctl("start", ONE_ROBOT).status == exit_codes.OK


def test_a_host_that_is_cut_off_costs_only_its_own_robots(swarm: LabSwarm) -> None:
    swarm.cut(ITS_HOST)
    try:
        with swarm.driving(LEADER, "koala", SPEED):
            run = swarm.swarmctl("stop")
            assert run.status == exit_codes.HOSTS_UNREACHABLE
            assert f"{ONE_ROBOT}  NOT STOPPED: {ITS_HOST}: " in run.out
            assert not moves(swarm.robot("koala"))
    finally:
        swarm.join(ITS_HOST)
        assert swarm.swarmctl("start").status == exit_codes.OK
