"""A robot of a vendor behind its gate, whatever its ROS: a base of classes of tests.

The lab's stand-in obeys its last command for ever.
"""

from __future__ import annotations

import time

from swarmctl.cli import exit_codes
from tests.e2e.lab_swarm import SWARM, LabSwarm, Publisher, moves, until
from tests.timing import Promise

DESK, PI = "desk", "pi"
EXECUTED = "cart"
GATE = f"swarm-{SWARM}.{EXECUTED}.gate.service"
SPEED = 0.2  # m/s
STOPPED = 1.0  # s: 0.5 s; the true state is 0.1 s old, and ssh takes its time
CART = """\
  cart:
    title: Cart of a vendor
    driver:
      package: cart_driver
      executable: cart_node
      command: ~cmd_vel
      publishes: [{topic: odom, type: nav_msgs/Odometry, rate: 10.0}]
    kinematics: {kind: differential, linear_max: 0.5, angular_max: 2.0, wheel_separation: 0.3}
"""


def recovers(fleet: LabSwarm) -> None:
    until(lambda: fleet.swarmctl("status").status == 0, "the swarm does not become healthy")


class Gated:
    """However a gate ends. The fixture ``fleet`` is the deployed lab; who publishes on PI may command."""

    KILLED: float  # s
    HUNG: float  # s

    def then(self, commander: Publisher) -> None:
        """What happens together with the end of the gate."""

    def test_who_publishes_past_the_gate_is_named(self, fleet: LabSwarm) -> None:
        with fleet.publishing(DESK, f"{EXECUTED}/gate", 0.3) as publisher:
            line = f"on /{EXECUTED}/gate/cmd_vel: the driver obeys it past the gate"
            until(lambda: line in fleet.swarmctl("status").out, "status does not name it")
            assert fleet.swarmctl("status").status == exit_codes.UNHEALTHY
            publisher.kill()
        fleet.seconds_to_standstill(EXECUTED)
        recovers(fleet)

    def test_its_gate_is_killed_and_the_robot_stands(self, fleet: LabSwarm, promise: Promise) -> None:
        with fleet.driving(PI, EXECUTED, SPEED) as commander:
            began = time.monotonic()
            fleet.shell(PI, f"sudo systemctl kill -s KILL {GATE}")
            self.then(commander)
            fleet.seconds_to_standstill(EXECUTED)
            took = time.monotonic() - began
        promise(f"cart of a vendor, {fleet.ros.name}: gate killed, until it stands", took, self.KILLED)
        with fleet.driving(PI, EXECUTED, SPEED):
            pass
        fleet.seconds_to_standstill(EXECUTED)
        recovers(fleet)

    def test_its_gate_is_stopped_and_the_robot_stands(self, fleet: LabSwarm, promise: Promise) -> None:
        with fleet.driving(PI, EXECUTED, SPEED):
            began = time.monotonic()
            fleet.shell(PI, f"sudo systemctl stop --no-block {GATE}")
            fleet.seconds_to_standstill(EXECUTED)
            took = time.monotonic() - began
            promise(
                f"cart of a vendor, {fleet.ros.name}: gate's unit stopped, until it stands", took, STOPPED
            )
            place = fleet.robot(EXECUTED)["distance"]
            run = fleet.swarmctl("status")
            assert run.status == exit_codes.UNHEALTHY
            assert GATE in run.out
            assert fleet.robot(EXECUTED)["distance"] == place
            fleet.shell(PI, f"sudo systemctl start {GATE}")
            until(lambda: moves(fleet.robot(EXECUTED)), "its gate does not obey again")
        fleet.seconds_to_standstill(EXECUTED)
        recovers(fleet)

    def test_its_gate_hangs_and_the_robot_stands(self, fleet: LabSwarm, promise: Promise) -> None:
        with fleet.driving(PI, EXECUTED, SPEED) as commander:
            began = time.monotonic()
            fleet.shell(PI, f"sudo systemctl kill --kill-who=main -s STOP {GATE}")
            self.then(commander)
            fleet.seconds_to_standstill(EXECUTED)
            took = time.monotonic() - began
        promise(f"cart of a vendor, {fleet.ros.name}: gate hung (SIGSTOP), until it stands", took, self.HUNG)
        fleet.seconds_to_standstill(EXECUTED)
        recovers(fleet)
