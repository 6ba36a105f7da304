"""One swarm of ROS 1 and ROS 2: what must arrive in the other world, and what must not."""

from __future__ import annotations

import time

from tests.e2e import whole_graph
from tests.e2e.conducted import Conducted
from tests.e2e.experiment import LACKING, STILL, Experiment
from tests.e2e.lab_swarm import LEADER, SOURCE, moves, until
from tests.e2e.ros_commands import Ros2
from tests.timing import Promise

TB3 = "tb3-pi"
OUTAGE = 25.0  # s; DDS forgets a node that is silent for 20 s
STAND_IN = "/tb3/stand_in"  # of the vendor's driver, which the lab lacks
#: A node with the name of the keyboard program, which may command the Koala.
KEYS = Ros2().publish("/koala/cmd_vel", 0.1, 0.0, 10).replace("ros2_topic_pub", "keys")


class TestBoth(Conducted):
    """A Koala on Noetic and a TurtleBot on Jazzy, which has the relay, follow one gamepad on ROS 1."""

    EXAMPLE = "ros1-and-ros2"
    FOLLOWERS = ("koala", "tb3")

    def test_the_graph_has_just_what_the_spec_says(self, experiment: Experiment) -> None:
        """At the master of ROS 1, and of the other topics none is even a name in the domain of ROS 2."""
        wanted = whole_graph.expected(experiment.spec, LACKING)["ros1"]
        driver = experiment.spec.robots["tb3"].driver_node
        wanted = {whole_graph.End(one.topic, one.way, one.node.replace(driver, STAND_IN)) for one in wanted}
        until(
            lambda: not whole_graph.difference(self.graph(experiment, "ros1"), {"ros1": wanted}),
            lambda: "\n".join(whole_graph.difference(self.graph(experiment, "ros1"), {"ros1": wanted})),
        )
        topics = {one.topic for one in self.graph(experiment, "ros2")["ros2"]}
        assert {one for one in topics if one.startswith("/koala")} == {"/koala/odom"}

    def graph(self, experiment: Experiment, island: str) -> dict[str, set[whole_graph.End]]:
        return {island: whole_graph.real(experiment.lab, experiment.spec)[island]}

    def test_the_keyboard_of_ros_2_drives_the_robot_of_ros_1(self, experiment: Experiment) -> None:
        with experiment.lab.publishing(TB3, "koala", 0.1):
            experiment.refuses("koala", LEADER, Ros2.stranger)
        with experiment.lab.running(TB3, KEYS):
            until(lambda: moves(experiment.lab.robot("koala")), "the keyboard does not drive the koala")
        experiment.seconds_to_rest()

    def test_a_command_that_is_not_the_joysticks_crosses_in_vain(self, experiment: Experiment) -> None:
        with experiment.lab.publishing(LEADER, "tb3", 0.05):
            until(lambda: "/rostopic" in self.refused(experiment), "nothing is refused")
            experiment.stands("tb3")

    def refused(self, experiment: Experiment) -> str:
        return experiment.lab.shell(TB3, f"{SOURCE}; {Ros2().diagnosis('tb3: gate')}")

    def test_a_relay_that_is_killed_stops_the_far_robot(
        self, experiment: Experiment, promise: Promise
    ) -> None:
        """It stands until the relay is back; the Koala, which is at home, drives on."""
        with experiment.gamepad() as pad:
            experiment.drives(pad, *self.FOLLOWERS)
            began = time.monotonic()
            experiment.lab.shell(TB3, "sudo systemctl kill -s KILL swarm-newswarm.multimaster")
            until(lambda: not moves(experiment.lab.robot("tb3")), "tb3 drives on")
            promise("relay of ROS 1 and 2 killed, until its robot stands", time.monotonic() - began, STILL)
            assert moves(experiment.lab.robot("koala"))
            until(lambda: moves(experiment.lab.robot("tb3")), "tb3 is not driven again")
            pad.let_go()
            experiment.seconds_to_rest()

    def test_after_25_s_without_a_network_both_directions_are_back(self, experiment: Experiment) -> None:
        """The TurtleBot stands meanwhile, and no command from before moves it; TCP and DDS have given up."""
        with experiment.gamepad() as pad:
            experiment.drives(pad, *self.FOLLOWERS)
            experiment.lab.cut(TB3)
            until(lambda: not moves(experiment.lab.robot("tb3")), "tb3 drives on")
            pad.let_go()
            time.sleep(OUTAGE)
            experiment.lab.join(TB3)
            experiment.stands("tb3", 2.0)
            pad.hold(1.0)
            until(lambda: moves(experiment.lab.robot("tb3")), "tb3 is not driven again")
            pad.let_go()
            experiment.seconds_to_rest()
        self.receives_scans(experiment)

    def receives_scans(self, experiment: Experiment) -> None:
        read = f"{SOURCE}; timeout 10 rostopic echo -n 1 /tb3/scan/header"
        until(lambda: "seq" in experiment.lab.shell(LEADER, f"{read} || true"), "no scan crosses")

    def test_a_master_that_is_restarted_gets_its_publishers_back(self, experiment: Experiment) -> None:
        experiment.lab.shell(LEADER, "sudo systemctl restart swarm-newswarm.master")
        with experiment.gamepad() as pad:
            experiment.drives(pad, *self.FOLLOWERS)
            pad.let_go()
            experiment.seconds_to_rest()
        self.receives_scans(experiment)
