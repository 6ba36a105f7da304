"""Changes that lock their operator out: the host goes back by itself and answers, and the report says so."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

import pytest

from tests.e2e import lockouts
from tests.e2e.at_once import at_once
from tests.e2e.lab_swarm import LabSwarm
from tests.e2e.lockouts import LOCKOUTS
from tests.e2e.test_faults import ALL_AT_ONCE, ALL_FASTER, releases
from tests.timing import PATIENCE, Promise, wait_for

CONFIRM_WITHIN = 10
LONGEST = 10.0  # s after the deadline until the host can be reached


@pytest.fixture
def locked(swarm: LabSwarm) -> Iterator[LabSwarm]:
    yield swarm
    at_once([lambda host=host: lockouts.uninstall(swarm, host) for host in swarm.hosts])


def reached_again(swarm: LabSwarm, hosts: Mapping[str, str]) -> dict[str, float]:
    """When each host answers again, in s since the boot, after it did not."""
    found: dict[str, float] = {}

    def wait(host: str) -> None:
        for wanted in (False, True):
            wait_for(
                lambda wanted=wanted: lockouts.answers(swarm, host) is wanted, complaint=host, interval=0.2
            )
        found[host] = lockouts.boot_time()

    at_once([lambda host=host: wait(host) for host in hosts])
    return found


def test_hosts_that_lock_their_operator_out_go_back(locked: LabSwarm, promise: Promise) -> None:
    swarm = locked
    causes = {"koala-laptop": "firewall", "k3-pi": "subnet", "epuck-pi": "wlan"}
    faster = swarm.variant("faster", *ALL_FASTER)
    old, new = releases(swarm, swarm.spec, faster)
    for host, cause in causes.items():
        lockouts.install(swarm, host, LOCKOUTS[cause], new[host])
    deploy = swarm.begin("deploy", *ALL_AT_ONCE, "--confirm-within", str(CONFIRM_WITHIN), spec=faster)
    reached = reached_again(swarm, causes)
    report, progress = deploy.communicate(timeout=PATIENCE)
    assert deploy.returncode == 3, report
    assert "0 of 3 hosts changed" in report
    for host, cause in causes.items():
        assert swarm.release(host) == old[host]
        assert lockouts.turns(swarm, host) == ["open", "shut", "open"]
        assert re.search(
            f"^{host}: failed: the deploy was not confirmed in time; undone, release {old[host]} runs again",
            progress,
            re.MULTILINE,
        ), progress
        seconds = reached[host] - lockouts.deadline(swarm, host)
        promise(f"locked out by a release ({cause}): reached, after the deadline", seconds, LONGEST)


@pytest.mark.slow
@pytest.mark.parametrize(
    "names",
    [("firewall", "subnet", "wlan"), ("port of sshd", "users of sshd", "stopped sshd")],
    ids=", ".join,
)
def test_a_power_cut_while_the_operator_is_locked_out_changes_nothing(
    locked: LabSwarm, names: tuple[str, ...]
) -> None:
    swarm = locked
    causes = dict(zip(swarm.hosts, names, strict=True))
    faster = swarm.variant("faster", *ALL_FASTER)
    old, new = releases(swarm, swarm.spec, faster)
    for host, cause in causes.items():
        lockouts.install(swarm, host, LOCKOUTS[cause], new[host])
    deploy = swarm.begin("deploy", *ALL_AT_ONCE, "--confirm-within", "60", spec=faster)
    for host in causes:
        wait_for(lambda host=host: not lockouts.answers(swarm, host), interval=0.2)
    at_once([lambda host=host: swarm.kill(host) for host in causes])
    at_once([lambda host=host: swarm.start(host) for host in causes])
    report, progress = deploy.communicate(timeout=PATIENCE)
    assert deploy.returncode == 3, report
    for host in causes:
        assert swarm.release(host) == old[host]
        assert lockouts.answers(swarm, host)
        assert f"the host restarted before the deploy was confirmed; undone, release {old[host]}" in progress
    assert "0 of 3 hosts changed" in report
