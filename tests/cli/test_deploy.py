"""``swarmctl deploy`` with hosts that are away: whose absence counts, and its message."""

from __future__ import annotations

import pytest
from swarm_onboard.agent.systemd import UnitState

from swarmctl.cli import exit_codes, rollout_output
from swarmctl.deploy.outcome import Outcome
from swarmctl.plan.plan import HostPlan
from swarmctl.remote.transport import HostError, Kind
from swarmctl.swarm.resolved import Host
from swarmctl.views.rollout import RolloutView, summary

DONE = Outcome(HostPlan("laptop", "a", "a"))
AWAY = HostError(Kind.UNREACHABLE, "connect timed out")
REFUSED = HostError(Kind.REFUSED, "it lacks rospy")


def host(name: str, *, optional: bool) -> Host:
    return Host(
        name, "192.168.77.10", ros_address="192.168.77.10", advertised="192.168.77.10", optional=optional
    )


@pytest.mark.parametrize(
    ("error", "optional", "code", "message"),
    [
        (AWAY, True, exit_codes.OK, "0 of 2 hosts changed; optional and unreachable: pi"),
        (AWAY, False, exit_codes.HOSTS_UNREACHABLE, "0 of 2 hosts changed; failed: pi; run the same"),
        (REFUSED, True, exit_codes.HOSTS_FAILED, "0 of 2 hosts changed; failed: pi"),
    ],
)
def test_an_optional_host_may_be_away_but_not_refuse(
    error: HostError, optional: bool, code: int, message: str
) -> None:
    found = {"laptop": DONE, "pi": error}
    hosts = {"laptop": host("laptop", optional=False), "pi": host("pi", optional=optional)}
    absent = rollout_output.absent(found, hosts)
    assert rollout_output.exit_code(found, interrupted=False, absent=absent) == code
    assert summary(found, absent).startswith(message)


def test_a_robot_without_its_device_is_no_plain_success() -> None:
    text = "/dev/swarm/k3 is missing: is the cable plugged in, the robot on?"
    driver = UnitState("loaded", "active", "running", "success", text, 7, 0, error=True)
    found = {"laptop": DONE, "pi": Outcome(HostPlan("pi", "a", "b"), {"swarm-new.k3.service": driver})}
    assert rollout_output.exit_code(found, interrupted=False) == exit_codes.UNHEALTHY
    assert f"note: pi: swarm-new.k3.service runs with an error: {text}" in RolloutView().text(found).plain


def test_hosts_that_were_held_back_are_no_failures() -> None:
    held = HostError(Kind.HELD, "nothing was changed, since pi cannot run its part")
    found = {"laptop": held, "desk": held, "pi": HostError(Kind.UNFIT, "it lacks rospy", "swarmctl prepare")}
    assert summary(found) == "0 of 3 hosts changed; held back: laptop, desk; failed: pi"
    assert rollout_output.unfit(found) == "pi"
    assert rollout_output.exit_code(found, interrupted=False) == exit_codes.HOSTS_FAILED
