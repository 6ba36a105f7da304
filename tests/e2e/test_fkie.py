"""Three islands joined by fkie's own packages, as generated: exactly the declared topics cross.

The packages are not Debian's: $SWARMCTL_WORKSPACE names built workspaces that hold them, divided by colons.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from swarmctl.render.ros1.multimaster.fkie import FAMILIES
from swarmctl.swarm.resolved import Swarm
from tests.e2e.lab_masters import Registrations, allowed, crossed, due, registered
from tests.e2e.lab_needs import workspace_with
from tests.e2e.lab_swarm import (
    SOURCE,
    LabSwarm,
    Note,
    SshError,
    lab_of,
    until,
)
from tests.loading import load_swarm

SPEC = Path(__file__).with_name("three-islands.yaml")
STILL = 6.0  # s for which nothing else may cross: longer than all of fkie's own delays


@dataclass(frozen=True)
class Joined:
    """Three islands in a lab, deployed. ``seconds`` is what it took until all had crossed."""

    family: str
    lab: LabSwarm
    islands: Swarm
    seconds: float

    def received(self, host: str, topic: str, seconds: int = 10) -> bool:
        command = f"{SOURCE}; timeout {seconds} rostopic echo -n 1 {topic}"
        try:
            self.lab.shell(host, command, timeout=seconds + 10)
        except SshError:
            return False
        return True

    def both_ways(self) -> bool:
        return self.received("epuck-pi", "/k3/odom") and self.received("koala-laptop", "/epuck/odom")

    def nothing_else(self, seconds: float = STILL) -> None:
        """Watch that nothing crosses but what is declared."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            for island, found in crossed(registered(self.lab, self.islands)).items():
                assert found <= allowed(self.islands)[island], f"crossed to {island}: {found}"
            time.sleep(0.2)


def settled(lab: LabSwarm, islands: Swarm) -> float:
    """Wait until all that is declared and published has crossed, and nothing else. Gives the seconds."""
    seen: Registrations = {}

    def all_crossed() -> bool:
        seen.update(registered(lab, islands))
        return all(seen.values()) and crossed(seen) == due(seen, islands)

    return until(all_crossed, lambda: f"crossed: {crossed(seen)}, due: {due(seen, islands)}")


@pytest.fixture(scope="module", params=FAMILIES)
def joined(request: pytest.FixtureRequest, workplace: Path) -> Iterator[Joined]:
    family: str = request.param
    workspace = workspace_with(FAMILIES[family].discovery.package, FAMILIES[family].sync.package)
    folder = workplace / family
    folder.mkdir()
    spec = folder / "spec.yaml"
    spec.write_text(SPEC.read_text("utf-8").replace("packages: fkie_multimaster", f"packages: {family}"))
    islands, findings = load_swarm(spec)
    assert islands is not None, findings
    with lab_of(f"fkie-{os.getpid()}", spec, folder, "--workspace", workspace) as lab:
        run = lab.deploy()
        assert run.status == 0, run.out + run.err
        yield Joined(family, lab, islands, settled(lab, islands))


def test_exactly_the_declared_topics_cross(joined: Joined, note: Note) -> None:
    joined.nothing_else()
    note(f"{joined.family}: deployed, until all has crossed", f"{joined.seconds:.1f} s", "")


def test_topics_of_an_islands_other_hosts_arrive(joined: Joined) -> None:
    assert joined.both_ways()


def test_commands_cross_to_the_robot_that_they_are_for(joined: Joined) -> None:
    with joined.lab.driving("koala-laptop", "epuck", 0.05):
        pass


def test_topics_reach_no_undeclared_island(joined: Joined) -> None:
    """A subscriber on an island that a topic does not go to; commands from islands that may not command."""
    assert not joined.received("lone-pi", "/k3/odom", 5)
    with (
        joined.lab.publishing("lone-pi", "epuck", 0.05),
        joined.lab.publishing("epuck-pi", "k3", 0.05),
        joined.lab.publishing("epuck-pi", "undeclared", 0.05),
    ):
        joined.nothing_else()
        assert not joined.lab.robot("epuck")["left"]
        assert not joined.lab.robot("k3")["left"]


def test_nothing_runs_against_its_direction(joined: Joined) -> None:
    """The big island receives /epuck/odom; what is published there under that name stays there."""
    command = f"{SOURCE}; timeout {STILL:g} rostopic pub -r 5 /epuck/odom nav_msgs/Odometry"
    joined.lab.shell("koala-laptop", f"({command} '{{child_frame_id: impostor}}') >/dev/null 2>&1 &")
    joined.nothing_else()


@pytest.mark.parametrize("host", ["koala-laptop", "epuck-pi"])
def test_a_master_that_restarts_is_joined_again(joined: Joined, host: str, note: Note) -> None:
    lab = joined.lab
    before = lab.units(host)["master"].pid
    lab.shell(host, "sudo pkill -9 -f '[r]osmaster --core'")
    began = time.monotonic()
    until(lambda: lab.units(host)["master"].pid not in (0, before), "the master does not restart")
    settled(lab, joined.islands)
    assert joined.both_ways()
    took = time.monotonic() - began
    note(f"{joined.family}: master of {host} killed, until both ways are received", f"{took:.1f} s", "")
    joined.nothing_else()


def test_a_hub_that_loses_its_power_is_joined_again(joined: Joined, note: Note) -> None:
    joined.lab.kill("epuck-pi")
    time.sleep(3)
    began = time.monotonic()
    joined.lab.start("epuck-pi")
    settled(joined.lab, joined.islands)
    assert joined.both_ways()
    took = time.monotonic() - began
    note(f"{joined.family}: hub switched on again, until both ways are received", f"{took:.1f} s", "")


def test_a_link_that_was_down_for_half_a_minute_heals(joined: Joined, note: Note) -> None:
    joined.lab.cut("epuck-pi")
    time.sleep(30)
    began = time.monotonic()
    joined.lab.join("epuck-pi")
    settled(joined.lab, joined.islands)
    assert joined.both_ways()
    with joined.lab.driving("koala-laptop", "epuck", 0.05):
        pass
    took = time.monotonic() - began
    note(f"{joined.family}: link back after 30 s, until received and driven", f"{took:.1f} s", "")


def test_a_second_deploy_has_nothing_to_do(joined: Joined) -> None:
    assert joined.lab.steps() == {}


def test_the_unit_is_hardened(joined: Joined) -> None:
    command = "systemd-analyze security --no-pager swarm-newswarm.multimaster.service | tail -1"
    output = joined.lab.shell("epuck-pi", command)
    assert float(output.split(":")[1].split()[0]) <= 2.0, output
