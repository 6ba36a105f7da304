"""``swarmctl deploy`` with hosts that are away: whose absence counts, and what is said of it."""

from __future__ import annotations

import pytest

from swarmctl.cli import carry_out, exits
from swarmctl.deploy.rollout import Outcome
from swarmctl.plan.plan import HostPlan
from swarmctl.remote.transport import HostError, Kind
from swarmctl.topology.swarm import Host

DONE = Outcome(HostPlan("laptop", "a", "a"))
AWAY = HostError(Kind.UNREACHABLE, "connect timed out")
REFUSED = HostError(Kind.REFUSED, "it lacks rospy")


def host(name: str, *, optional: bool) -> Host:
    return Host(name, "192.168.77.10", "192.168.77.10", "robot", 22, None, optional)


@pytest.mark.parametrize(
    ("error", "optional", "code", "said"),
    [
        (AWAY, True, exits.OK, "0 of 2 hosts changed; away, and optional: pi"),
        (AWAY, False, exits.HOSTS_UNREACHABLE, "0 of 2 hosts changed; not done: pi; run the same"),
        (REFUSED, True, exits.HOSTS_FAILED, "0 of 2 hosts changed; not done: pi"),
    ],
)
def test_an_optional_host_may_be_away_but_not_refuse(
    error: HostError, optional: bool, code: int, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    found = {"laptop": DONE, "pi": error}
    hosts = {"laptop": host("laptop", optional=False), "pi": host("pi", optional=optional)}
    absent = carry_out.absent(found, hosts)
    assert carry_out.exit_code(found, interrupted=False, absent=absent) == code
    carry_out.report(found, absent)
    assert capsys.readouterr().out.splitlines()[-1].startswith(said)
