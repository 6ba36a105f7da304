"""The paper's five experiments (section 5), each in its own lab: what must arrive, and what must not."""

from __future__ import annotations

import io
import re
import subprocess
import tarfile
import time

import pytest

from swarmctl.cli import exit_codes
from tests.e2e import whole_graph
from tests.e2e.conducted import Tried
from tests.e2e.experiment import EXAMPLES, Experiment
from tests.e2e.lab_swarm import HOME, LEADER, LabSwarm, Note, moves, until
from tests.e2e.ros_peers import roswtf
from tests.e2e.security_level import GUARDED, LEVEL
from tests.timing import Promise


class OnMasters(Tried):
    """What holds for every experiment of ROS 1."""

    @pytest.mark.slow
    def test_roswtf_finds_no_fault(self, experiment: Experiment) -> None:
        spec = experiment.spec
        nodes = {
            island.name: {
                *(one.driver_node for host in island.hosts for one in spec.robots_on(host)),
                *(one.node for one in spec.programs.values() if one.host in island.hosts),
            }
            for island in spec.islands
        }
        elsewhere = {
            host: set().union(*(those for name, those in nodes.items() if name != island.name))
            for island in spec.islands
            for host in island.hosts
        }
        assert roswtf(experiment.lab, f"{HOME}/current", list(elsewhere), elsewhere) == {}


class TestSingleMinded(OnMasters):
    """One computer runs everything, small robots obey it over Bluetooth."""

    EXAMPLE = "paper-1-single-minded"
    FOLLOWERS = ("koala", "k3", "epuck-1", "epuck-2")

    def test_nothing_runs_on_another_computer(self, experiment: Experiment) -> None:
        assert experiment.lab.units("desktop") == {}
        assert experiment.lab.shell("desktop", "pgrep -a python3 || true") == ""

    def test_a_command_from_another_computer_moves_nothing(self, experiment: Experiment) -> None:
        """Whoever names the leader's master joins its graph; the drivers reject its commands.

        In a filtered swarm the firewall drops its packets before.
        """
        hosts = experiment.spec.hosts
        uri = experiment.spec.master_uri(experiment.spec.islands[0])
        joined = f"export ROS_MASTER_URI={uri} ROS_IP={hosts['desktop'].address}"
        with experiment.lab.publishing("desktop", "k3", 0.1, source=joined):
            if LEVEL in GUARDED:
                experiment.stands("k3")
            else:
                experiment.refuses("k3", LEADER)

    def test_all_robots_stand_before_a_deploy_stops_any_unit(
        self, experiment: Experiment, note: Note
    ) -> None:
        swarm = experiment.lab
        address = "koala-laptop: {address: 192.168.77.10, "
        other_port = swarm.variant("other-port", (address, f"{address}master_port: 11411, "))
        with experiment.gamepad() as pad:
            experiment.drives(pad, *self.FOLLOWERS)
            refused = swarm.deploy(other_port)
            assert refused.status == exit_codes.HOSTS_FAILED, refused.out + refused.err
            named = (re.search(rf"{one} (is commanded|moves)", refused.out) for one in self.FOLLOWERS)
            assert all(named), refused.out
            with swarm.begin("deploy", "--stop-robots", spec=other_port) as deploy:
                until(lambda: not any(map(moves, swarm.robots().values())), "robots drive on")
                stood = time.monotonic()  # hosts of the lab have the same clock
                assert deploy.wait(120) == exit_codes.OK, deploy.communicate()
            pad.let_go()
        units = " ".join(f"swarm-newswarm.{one}" for one in (*self.FOLLOWERS, "joystick", "master"))
        ended = swarm.shell(LEADER, f"systemctl show -P InactiveEnterTimestampMonotonic {units}").split()
        ahead = min(map(int, ended)) / 1e6 - stood
        note(f"{self.EXAMPLE}: the last wheel stands before the first unit stops", f"{ahead:.2f} s", "> 0 s")
        assert ahead > 0
        assert not experiment.moving()
        assert swarm.deploy(None, "--wait", "30").status == exit_codes.OK
        assert swarm.swarmctl("start").status == exit_codes.OK


class TestLeader(OnMasters):
    """Three robots with computers of their own follow the Koala's."""

    EXAMPLE = "paper-2-leader"
    FOLLOWERS = ("koala", "k3", "epuck")

    @pytest.mark.parametrize("host", ["k3-pi", LEADER])
    def test_a_command_that_is_not_the_joysticks_moves_nothing(
        self, experiment: Experiment, host: str
    ) -> None:
        """In a filtered swarm the guard of the master refuses what comes from a host of no commander."""
        with experiment.lab.publishing(host, "epuck", 0.05):
            if LEVEL in GUARDED and host != LEADER:
                experiment.guard_refuses("epuck", host, LEADER)
            else:
                experiment.refuses("epuck", "epuck-pi")


class TestCentral(OnMasters):
    """Robots of their own mind that meet at one master."""

    EXAMPLE = "paper-3-central"
    FOLLOWERS = ("koala", "epuck")
    TRIAL = 20  # s; the Khepera's program starts with the trial, and is slow

    @classmethod
    def prepare(cls, swarm: LabSwarm) -> None:
        """The Khepera's own program goes where a Debian has its ROS packages."""
        packed = io.BytesIO()
        with tarfile.open(fileobj=packed, mode="w") as archive:
            archive.add(EXAMPLES / cls.EXAMPLE / "simple_moves", "simple_moves")
        argv = swarm.shell_argv("k3-pi", "sudo tar -xC /usr/share --no-same-owner")
        subprocess.run(argv, input=packed.getvalue(), check=True, timeout=30)

    def test_the_gamepad_drives_its_robots_and_no_others(
        self, experiment: Experiment, note: Note, promise: Promise
    ) -> None:
        """The Khepera goes its own way until its own program ends; then no gamepad moves it."""
        until(lambda: moves(experiment.lab.robot("k3")), "k3 does not drive its square")
        experiment.lab.shell("k3-pi", "sudo systemctl stop swarm-newswarm.square")
        experiment.seconds_to_rest()
        super().test_the_gamepad_drives_its_robots_and_no_others(experiment, note, promise)

    def test_a_command_from_another_computer_does_not_move_the_khepera(self, experiment: Experiment) -> None:
        with experiment.lab.publishing(LEADER, "k3", 0.1):
            experiment.refuses("k3", "k3-pi")


class TestStandalone(OnMasters):
    """Every robot has a master of its own, and all follow one gamepad."""

    EXAMPLE = "paper-4-standalone"
    FOLLOWERS = ("koala", "k3", "epuck")

    def test_what_is_not_declared_stays_at_home(self, experiment: Experiment) -> None:
        lists = whole_graph.real(experiment.lab, experiment.spec)
        at = [island for island, ends in lists.items() if "/k3/proximity" in {end.topic for end in ends}]
        assert at == ["k3-pi"]

    def test_a_command_under_a_foreign_master_does_not_arrive(self, experiment: Experiment) -> None:
        with experiment.lab.publishing("k3-pi", "epuck", 0.05):
            experiment.receives_nothing("epuck", published_on="k3-pi", home="epuck-pi")


class TestCombined(OnMasters):
    """Groups of simple robots around leaders, and a robot that stands alone."""

    EXAMPLE = "paper-5-combined"
    FOLLOWERS = ("koala", "epuck-1", "epuck-2", "khepera-2")

    def test_a_simple_robot_is_deaf_to_another_island(self, experiment: Experiment) -> None:
        with experiment.lab.publishing("epuck-pi", "khepera_2", 0.05):
            experiment.receives_nothing("khepera-2", published_on="lone-epuck", home="khepera-group")

    def test_a_simple_robot_refuses_what_is_not_the_joysticks(self, experiment: Experiment) -> None:
        """The topic crosses from the Koala's laptop: whatever is published there arrives, and is refused."""
        with experiment.lab.publishing(LEADER, "khepera_2", 0.05):
            experiment.refuses("khepera-2", "k3-pi")
