from __future__ import annotations

from pathlib import Path

import pytest
from swarm_onboard.agent import preflight
from swarm_onboard.agent.release_store import Home
from swarm_onboard.host_checks.chrony import Seen, judge, observe

from swarmctl.render.quoting import render

ROOT = "192.168.77.10"
FOLLOWER = render("follower.chrony", root=ROOT, name="hub", allowed=[]).decode()
UNRESOLVED = FOLLOWER.replace(ROOT, "name.invalid")
SERVES = render("root.chrony", servers=["ntp.lab.example"], allowed=["10.0.0.0/8"], anyone=False).decode()
# What `chronyc -n -c tracking` of chrony 4.3 prints.
NOT_YET = "00000000,,0,0.000000000,0.0,0.0,0.0,0.000,0.000,0.000,1.0,1.0,0.0,Not synchronised"
ALONE = "7F7F0101,,10,1795707028.984715880,0.0,0.0,0.0,0.000,0.000,0.000,0.0,0.0,0.0,Normal"
IN_STEP = "C0A84D0A,{},11,1795707030.284,-0.000001,0.0,0.0,-0.222,0.000,11.818,0.00001,0.00001,0.3,Normal"
SILENT = "506 Cannot talk to daemon"


def host(folder: Path, block: str, answer: str) -> Home:
    """A host whose chronyc prints ``answer``."""
    chronyc = folder / "usr/bin/chronyc"
    chronyc.parent.mkdir(parents=True)
    chronyc.write_text(f"#!/bin/sh\n[ \"$*\" = '-n -c tracking' ] && echo '{answer}'\n")
    chronyc.chmod(0o755)
    conf = folder / "etc/chrony/chrony.conf"
    conf.parent.mkdir(parents=True)
    conf.write_text(f"pool 2.debian.pool.ntp.org iburst\n{block}")
    return Home("new", str(folder))


@pytest.fixture
def alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """A host with a clock of its own."""
    monkeypatch.setattr(preflight, "clock", lambda: "alone")


def of_the_swarm(text: str) -> str:
    return f"\n# >>> swarm new\n{text}# <<< swarm new\n"


@pytest.mark.usefixtures("alone")
@pytest.mark.parametrize(
    ("block", "answer", "state", "message"),
    [
        (FOLLOWER, IN_STEP.format(ROOT), "ok", f"its clock follows {ROOT}"),
        (FOLLOWER, IN_STEP.format("192.0.2.7"), "warning", f"follows 192.0.2.7 instead of {ROOT}"),
        (FOLLOWER, ALONE, "warning", f"follows nobody instead of {ROOT}"),
        (FOLLOWER, NOT_YET, "warning", f"not synchronised: {ROOT} has not given it the time"),
        (FOLLOWER, SILENT, "warning", "chronyd does not answer"),
        (UNRESOLVED, IN_STEP.format(ROOT), "ok", "its clock follows name.invalid"),
        (SERVES, ALONE, "ok", "serves its own time"),
        (SERVES, IN_STEP.format("192.0.2.7"), "ok", "its clock follows 192.0.2.7"),
        (SERVES, NOT_YET, "warning", "not synchronised: it gives the others no time"),
        (SERVES, SILENT, "warning", "chronyd does not answer"),
    ],
)
def test_a_clock_follows_the_root_and_the_root_anybody(
    tmp_path: Path, block: str, answer: str, state: str, message: str
) -> None:
    (seen,) = observe(host(tmp_path, of_the_swarm(block), answer))
    found = judge(seen, "pi")
    assert (found.state, message in found.message) == (state, True)
    assert found.state == "ok" or found.hint.startswith("on pi")


def test_the_name_of_a_root_is_resolved(tmp_path: Path) -> None:
    block = of_the_swarm(FOLLOWER.replace(ROOT, "localhost"))
    (seen,) = observe(host(tmp_path, block, IN_STEP.format(ROOT)))
    assert seen == Seen("localhost", ROOT, "Normal", same=False)


def test_a_container_without_a_clock_of_its_own_is_not_checked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Such as a host of the lab: systemd starts no chronyd there."""
    monkeypatch.setattr(preflight, "clock", lambda: "borrowed")
    assert observe(host(tmp_path, of_the_swarm(FOLLOWER), SILENT)) == []


def test_chrony_that_the_swarm_does_not_configure_is_not_checked(tmp_path: Path) -> None:
    assert observe(host(tmp_path, of_the_swarm(FOLLOWER).replace("swarm new", "swarm old"), NOT_YET)) == []


@pytest.mark.usefixtures("alone")
def test_a_host_without_chrony_is_not_checked(tmp_path: Path) -> None:
    assert observe(Home("new", str(tmp_path))) == []
    home = host(tmp_path, of_the_swarm(FOLLOWER), SILENT)
    (tmp_path / "usr/bin/chronyc").unlink()
    assert observe(home) == []
