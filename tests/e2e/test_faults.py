"""Deploys that meet trouble: a host dies, is cut off or is another one, or somebody else deploys."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest

from tests.e2e.at_once import at_once
from tests.e2e.lab_swarm import HOME, LabSwarm, Note, Run, until
from tests.timing import Promise, wait_for

CONNECT_TIMEOUT = 10.0  # s, of swarmctl
HOST_KEY = "/etc/ssh/ssh_host_ed25519_key"
ALL_FASTER = tuple(
    (f"{{type: {robot}}}", f"{{type: {robot}, settings: {{rates: {{odom: 20, light: 2}}}}}}")
    for robot in ("koala, host: koala-laptop", "khepera3, host: k3-pi", "epuck, host: epuck-pi")
)
ALL_AT_ONCE = ("--serial", "100%", "--keep-going")
ALL_SLOWER = tuple((old, new.replace("odom: 20", "odom: 4")) for old, new in ALL_FASTER)


def releases(swarm: LabSwarm, *specs: object) -> list[dict[str, str]]:
    """For each spec, the release that it makes of every host."""
    found = []
    for spec in specs:
        hosts = swarm.swarmctl("plan", "--offline", "--json", spec=spec).json()["hosts"]
        found.append({host["host"]: host["next"] for host in hosts})
    return found


@pytest.mark.slow
def test_hosts_that_lose_power_are_named_and_finished_by_the_next_run(swarm: LabSwarm, note: Note) -> None:
    faster = swarm.variant("faster", *ALL_FASTER)
    old, new = releases(swarm, swarm.spec, faster)
    dies_at = {"k3-pi: staging": "k3-pi", "epuck-pi: starting": "epuck-pi"}
    deploy = swarm.begin("deploy", *ALL_AT_ONCE, "--confirm-within", "10", spec=faster)
    assert deploy.stderr is not None
    for line in deploy.stderr:
        for words, host in dies_at.items():
            if line.startswith(words):
                swarm.kill(host)
    assert deploy.stdout is not None
    report = deploy.stdout.read()
    assert deploy.wait(30) == 3, report
    assert re.search("^koala-laptop  deployed", report, re.MULTILINE)
    assert re.search(
        "^k3-pi, epuck-pi  lost: |^k3-pi  lost: (.*\n)*epuck-pi  lost: ", report, re.MULTILINE
    ), report
    assert "failed: k3-pi, epuck-pi; run the same command again" in report

    at_once([lambda host=host: swarm.start(host) for host in dies_at.values()])
    for host in swarm.hosts:
        assert swarm.release(host) in (old[host], new[host])
    assert swarm.release("koala-laptop") == new["koala-laptop"]
    # Its boot has undone the change, before any unit of the swarm started.
    assert swarm.release("epuck-pi") == old["epuck-pi"]
    until(lambda: swarm.units("epuck-pi")["epuck"].active == "active", "its driver does not run")
    steps = swarm.steps(faster)
    assert not [
        step for host in steps.values() for step in host if "damaged" in step[2] or "missing" in step[2]
    ]
    plan = swarm.plan(faster).out
    assert "epuck-pi: the deploy of release" in plan, plan
    assert re.search("epuck-pi: .* did not stay: .*; undone, release", plan), plan

    again = swarm.deploy(faster)
    assert again.status == 0, again.out + again.err
    assert {host: swarm.release(host) for host in swarm.hosts} == new
    assert swarm.plan(faster).status == 0
    assert all(unit.active == "active" for unit in swarm.units("k3-pi").values())
    note("deploy that finishes what two dead hosts left", f"{again.seconds:.1f} s", "")


def test_an_unreachable_host_fails_alone_and_soon(swarm: LabSwarm, promise: Promise) -> None:
    faster = swarm.variant("faster", *ALL_FASTER)
    swarm.cut("k3-pi")
    runs: dict[str, Run] = {}
    at_once(
        [
            lambda: runs.update(plan=swarm.plan(faster)),
            lambda: runs.update(deploy=swarm.deploy(faster, "--keep-going")),
        ]
    )
    for run in runs.values():
        assert run.status == 4, run.out + run.err
        assert "k3-pi  unreachable: k3-pi (192.168.77.11, port 22)" in run.out
    assert "2 of 3 hosts changed; failed: k3-pi" in runs["deploy"].out
    seconds = float(
        re.findall(r"^k3-pi: unreachable: .* \(([0-9.]+) s\)$", runs["deploy"].err, re.MULTILINE)[0]
    )
    promise("given up on a host that is cut off", seconds, CONNECT_TIMEOUT + 2)


@pytest.mark.slow
def test_of_two_deploys_at_the_same_moment_one_has_all_hosts(swarm: LabSwarm) -> None:
    specs = swarm.variant("faster", *ALL_FASTER), swarm.variant("slower", *ALL_SLOWER)
    wanted = releases(swarm, *specs)
    both = [swarm.begin("deploy", spec=spec) for spec in specs]
    outputs = [run.communicate(timeout=180) for run in both]
    for run, (out, err) in zip(both, outputs, strict=True):
        assert run.returncode in (0, 3), out + err
        if run.returncode == 3:
            assert re.search("locked by root@|another deploy has changed it", out), out
            assert "0 of 3 hosts changed" in out, out
    assert {host: swarm.release(host) for host in swarm.hosts} in wanted
    assert swarm.deploy(specs[0]).status == 0
    assert swarm.plan(specs[0]).status == 0


def test_a_second_deploy_at_the_same_time_names_the_first(swarm: LabSwarm) -> None:
    faster = swarm.variant("faster", *ALL_FASTER)
    holder = (
        f"import fcntl, json, time; lock = open('{HOME}/state/lock', 'r+'); "
        "fcntl.flock(lock, fcntl.LOCK_EX); "
        "lock.truncate(); json.dump({'who': 'ann@desk (7)', 'pid': 1}, lock); lock.flush(); time.sleep(300)"
    )
    pid = swarm.shell("k3-pi", f'sudo sh -c \'python3 -c "$0" >/dev/null 2>&1 & echo $!\' "{holder}"').strip()
    wait_for(lambda: "ann@desk" in swarm.shell("k3-pi", f"sudo cat {HOME}/state/lock"))
    run = swarm.deploy(faster)
    swarm.shell("k3-pi", f"sudo kill {pid}")
    assert run.status == 3, run.out + run.err
    assert "k3-pi  refused: locked by ann@desk (7)" in run.out
    assert "0 of 3 hosts changed; held back: koala-laptop, epuck-pi; failed: k3-pi" in run.out


@pytest.fixture
def reflashed(swarm: LabSwarm) -> Iterator[LabSwarm]:
    """The swarm, with another host key on one of its hosts."""
    make = f"ssh-keygen -q -t ed25519 -N '' -f {HOST_KEY}"
    swarm.shell("epuck-pi", f"sudo mv {HOST_KEY} {HOST_KEY}.old && sudo {make} && sudo systemctl restart ssh")
    yield swarm
    swarm.shell(
        "epuck-pi",
        f"sudo mv {HOST_KEY}.old {HOST_KEY} && sudo rm {HOST_KEY}.pub && sudo systemctl restart ssh",
    )


# By identifier, not by unit: where a process ends at once, journald cannot find its unit any more.
_SSHD_LOG = "sudo journalctl -t sshd -t sshd-session -o cat"


def test_a_host_with_another_key_is_refused_before_anything_is_sent(reflashed: LabSwarm) -> None:
    swarm = reflashed
    keys = swarm.shell("epuck-pi", f"for key in {HOST_KEY}.old {HOST_KEY}; do sudo ssh-keygen -lf $key; done")
    pinned, shown = re.findall("SHA256:[A-Za-z0-9+/]+", keys)
    before = swarm.shell("epuck-pi", _SSHD_LOG)
    run = swarm.plan()
    assert run.status == 3
    assert "epuck-pi  host-key: " in run.out
    assert pinned in run.out
    assert shown in run.out
    # sshd writes about a connection that ended when it gets round to it.
    wait_for(
        lambda: swarm.shell("epuck-pi", _SSHD_LOG).count("[preauth]") > before.count("[preauth]"),
        interval=0.1,
    )
    assert swarm.shell("epuck-pi", _SSHD_LOG).count("Accepted") == before.count("Accepted")
