"""The paper's experiments of one island on ROS 2: what must arrive, and what must not."""

from __future__ import annotations

import io
import shlex
import subprocess
import tarfile
import time
from pathlib import Path

import pytest

from swarmctl.capsule import folder as capsules
from swarmctl.cli import exit_codes
from tests.e2e.bags import forget
from tests.e2e.conducted import Tried
from tests.e2e.experiment import EXAMPLES, STILL, Experiment
from tests.e2e.lab_swarm import LEADER, SOURCE, LabSwarm, Note, moves, quoted, until
from tests.timing import Promise

#: Prints the limit that the driver of k3 shows, and whether it takes another one from a stranger.
SHOWN = """
import rclpy, time
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
rclpy.init()
node = rclpy.create_node("looks")
client = AsyncParameterClient(node, "/k3/driver")
def result(future):
    rclpy.spin_until_future_complete(node, future)
    return future.result()
assert client.wait_for_services(30)
while (shown := result(client.get_parameters(["limits.linear"])).values[0].double_value) != VALUE:
    time.sleep(0.1)
print(shown)
print(result(client.set_parameters([Parameter("limits.linear", value=5.0)])).results[0].successful)
"""
#: Announces itself once, and from then on to newcomers alone.
ONCE = (
    "<builtin><discovery_config><leaseDuration><sec>172800</sec></leaseDuration><leaseAnnouncement>"
    "<sec>86400</sec></leaseAnnouncement><initialAnnouncements><count>0</count></initialAnnouncements>"
    "</discovery_config>"
)
RARELY = f"""{SOURCE}; sed {quoted(f"s,<builtin>,{ONCE},")} $FASTRTPS_DEFAULT_PROFILES_FILE > /tmp/rare.xml
export FASTRTPS_DEFAULT_PROFILES_FILE=/tmp/rare.xml"""
RARE_NODE = """
import rclpy
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node("rare")
publisher = node.create_publisher(String, "/rare", 1)
print("runs", flush=True)
rclpy.spin(node)
"""
OUTAGE = 30.0  # s; DDS forgets a node that is silent for 20 s


class TestSingleMinded(Tried):
    """One computer runs everything; its nodes look for no others."""

    EXAMPLE = "ros2-1-single-minded"
    FOLLOWERS = ("koala", "k3", "epuck-1", "epuck-2")

    def test_a_command_of_another_computer_does_not_arrive(self, experiment: Experiment) -> None:
        """In the same domain, by multicast, which the network passes on."""
        domain = experiment.spec.islands[0].discovery.domain
        distro = experiment.spec.distro
        joined = f"export HOME=/tmp; . /opt/ros/{distro}/setup.sh; export ROS_DOMAIN_ID={domain}"
        with experiment.lab.publishing("desktop", "k3", 0.1, source=joined):
            experiment.stands("k3", 3.0)
            assert experiment.lab.ros.stranger not in experiment.lab.diagnosis(LEADER, "k3")


class TestLeader(Tried):
    """Three robots with computers of their own follow the Koala's, on a network without multicast."""

    EXAMPLE = "ros2-2-leader"
    FOLLOWERS = ("koala", "k3", "epuck")

    @pytest.mark.parametrize("host", ["k3-pi", LEADER])
    def test_a_command_that_is_not_the_joysticks_moves_nothing(
        self, experiment: Experiment, host: str
    ) -> None:
        with experiment.lab.publishing(host, "epuck", 0.05):
            experiment.refuses("epuck", "epuck-pi")

    def test_a_node_that_answers_newcomers_alone_is_seen(self, experiment: Experiment) -> None:
        node = f"python3 -c {quoted(RARE_NODE)}"
        with experiment.lab.running(LEADER, node, source=RARELY) as rare:
            assert rare.process.stdout is not None
            assert rare.process.stdout.readline() == "runs\n"
            for _ in range(5):
                listed = experiment.lab.swarmctl("topic list", "--json").json()["topics"]
                assert "/rare" in {one["topic"] for one in listed}

    def test_a_driver_takes_a_lower_limit_and_shows_it(self, experiment: Experiment) -> None:
        lab, k3 = experiment.lab, "k3: {type: khepera3, host: k3-pi"
        slower = lab.variant("slower-k3", (f"{k3}}}", f"{k3}, settings: {{limits: {{linear: 0.04}}}}}}"))
        before = lab.pids()
        assert lab.deploy(slower).status == exit_codes.OK
        look = shlex.join(["python3", "-c", SHOWN.replace("VALUE", "0.04")])
        assert lab.shell("k3-pi", f"{SOURCE}; {look}").splitlines()[-2:] == ["0.04", "False"]
        assert lab.swarmctl("rollback", "--yes").status == exit_codes.OK
        assert lab.pids() == before

    def test_after_a_reboot_of_the_leader_the_gamepad_drives_all(
        self, experiment: Experiment, note: Note
    ) -> None:
        began = time.monotonic()
        experiment.lab.reboot(LEADER)
        with experiment.gamepad() as pad:
            experiment.drives(pad, *self.FOLLOWERS)
            note(f"{self.EXAMPLE}: leader rebooted, until all move", f"{time.monotonic() - began:.1f} s", "")
            pad.let_go()
            experiment.seconds_to_rest()

    def test_after_30_s_without_a_network_a_robot_is_driven_again(
        self, experiment: Experiment, note: Note
    ) -> None:
        """The robot stands meanwhile, and no command from before moves it."""
        with experiment.gamepad() as pad:
            experiment.drives(pad, *self.FOLLOWERS)
            experiment.lab.cut("k3-pi")
            until(lambda: not moves(experiment.lab.robot("k3")), "k3 drives on")
            pad.let_go()
            time.sleep(OUTAGE)
            experiment.lab.join("k3-pi")
            experiment.stands("k3", 2.0)
            began = time.monotonic()
            pad.hold(1.0)
            until(lambda: moves(experiment.lab.robot("k3")), "k3 is not driven again")
            note(f"{self.EXAMPLE}: network back, until k3 moves", f"{time.monotonic() - began + 2:.1f} s", "")
            pad.let_go()
            experiment.seconds_to_rest()


class TestCentral(Tried):
    """Robots of their own mind that meet at two discovery servers."""

    EXAMPLE = "ros2-3-central"
    FOLLOWERS = ("koala", "epuck")
    TRIAL = 20  # s; the Khepera's program starts with the trial, and is slow

    @classmethod
    def prepare(cls, swarm: LabSwarm) -> None:
        """The Khepera's own program goes where colcon installs it."""
        package, packed = EXAMPLES / cls.EXAMPLE / "simple_moves", io.BytesIO()
        index = "share/ament_index/resource_index/packages/simple_moves"
        with tarfile.open(fileobj=packed, mode="w") as archive:
            archive.add(package / "package.xml", "share/simple_moves/package.xml")
            archive.add(package / "scripts/square.py", "lib/simple_moves/square.py")
            archive.addfile(tarfile.TarInfo(index))
        argv = swarm.shell_argv("k3-pi", "sudo tar -xC /opt/ros/kilted --no-same-owner")
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

    @pytest.mark.parametrize("away", [LEADER, "k3-pi"])
    def test_one_discovery_server_is_enough_for_new_nodes(self, experiment: Experiment, away: str) -> None:
        """While the other server is stopped, a node that starts is found and refused."""
        unit = "swarm-newswarm.discovery"
        experiment.lab.shell(away, f"sudo systemctl stop {unit}")
        try:
            with experiment.lab.publishing("epuck-pi", "koala", 0.1):
                experiment.refuses("koala", LEADER)
        finally:
            experiment.lab.shell(away, f"sudo systemctl start {unit}")

    def test_a_program_of_trials_drives_until_a_topic_ends_them(
        self, experiment: Experiment, tmp_path: Path
    ) -> None:
        lab = experiment.lab
        spec = lab.variant(
            "until",
            ("    optional: true\n\ncontrol:", "    optional: true\n    lifecycle: trial\n\ncontrol:"),
            (
                "    robots: [koala, k3, epuck]\n",
                "    robots: [k3]\n    until: [{topic: k3/odom, distance: 0.1}]\n",
            ),
            ("      - {topic: koala/odom, distance: 0.2}\n", ""),
            ("      - {topic: epuck/odom, distance: 0.2}\n", ""),
            ("k3/odom, distance: 0.2", "k3/odom, distance: 0.1"),
        )
        try:
            assert lab.deploy(spec).status == exit_codes.OK
            experiment.stands("k3", 2.0)
            place = ("--out", str(tmp_path))
            run = lab.swarmctl("run", "own-programs", "--trial", "1", *place, "--json", spec=spec)
            assert run.status == exit_codes.OK, run.err
            (kept,) = run.json()["trials"]
            index = capsules.read(Path(kept["capsule"]))
            assert index.success is True
            assert index.ended - index.began < index.seconds, "it does not wait for its time"
        finally:
            lab.swarmctl("start")
            forget(lab)
            assert lab.deploy(None).status == exit_codes.OK


class TestStandalone(Tried):
    """Every robot is a domain of its own, and all follow one gamepad."""

    EXAMPLE = "ros2-4-standalone"
    FOLLOWERS = ("koala", "k3", "epuck")

    def test_a_command_of_another_domain_does_not_arrive(self, experiment: Experiment) -> None:
        with experiment.lab.publishing("k3-pi", "epuck", 0.05):
            experiment.receives_nothing("epuck", published_on="k3-pi", home="epuck-pi")

    def test_a_command_that_is_not_the_joysticks_crosses_in_vain(self, experiment: Experiment) -> None:
        with experiment.lab.publishing(LEADER, "epuck", 0.05):
            experiment.refuses("epuck", "epuck-pi")

    def test_a_relay_that_is_killed_stops_the_robot_until_it_is_back(
        self, experiment: Experiment, promise: Promise
    ) -> None:
        with experiment.gamepad() as pad:
            experiment.drives(pad, *self.FOLLOWERS)
            began = time.monotonic()
            experiment.lab.shell("k3-pi", "sudo systemctl kill -s KILL swarm-newswarm.multimaster")
            until(lambda: not moves(experiment.lab.robot("k3")), "k3 drives on")
            promise("relay killed, until its robot stands", time.monotonic() - began, STILL)
            until(lambda: moves(experiment.lab.robot("k3")), "k3 is not driven again")
            pad.let_go()
            experiment.seconds_to_rest()


class TestCombined(Tried):
    """Groups of simple robots around leaders, and a robot that stands alone."""

    EXAMPLE = "ros2-5-combined"
    FOLLOWERS = ("koala", "epuck-1", "epuck-2", "khepera-2")

    def test_a_simple_robot_is_deaf_to_another_island(self, experiment: Experiment) -> None:
        with experiment.lab.publishing("epuck-pi", "khepera_2", 0.05):
            experiment.receives_nothing("khepera-2", published_on="lone-epuck", home="khepera-group")
