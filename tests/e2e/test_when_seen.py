"""Hosts that come and go get the newest release once they answer: `deploy --when-seen` and `watch`."""

from __future__ import annotations

import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from swarmctl.cli import exit_codes
from tests.e2e.lab_swarm import HOME, LEADER, LabSwarm, moves, until
from tests.e2e.test_change import FASTER_K3, K3, SLOWER_K3

PI = "k3-pi"
KOALA = "koala: {type: koala, host: koala-laptop}"
SLOWER_KOALA = "koala: {type: koala, host: koala-laptop, settings: {limits: {linear: 0.1}}}"
FAST = "rate: 20.0"


def params(swarm: LabSwarm, host: str, robot: str) -> str:
    return swarm.shell(host, f"cat {HOME}/current/params/{robot}.yaml")


def test_a_host_that_was_off_gets_the_release_when_it_answers(swarm: LabSwarm) -> None:
    changed = swarm.variant("when-seen", (K3, FASTER_K3), (KOALA, SLOWER_KOALA))
    swarm.kill(PI)
    deploy = swarm.begin("deploy", "--yes", "--when-seen", "--healthy-for", "0.5", spec=changed)
    assert deploy.stderr is not None
    waits = "waiting, since k3-pi does not answer; Ctrl-C ends it\n"
    assert waits in iter(deploy.stderr.readline, ""), "it does not wait"
    assert "linear_max: 0.1" in params(swarm, LEADER, "koala")
    shown = swarm.swarmctl("status", spec=changed).out
    assert "k3-pi gets the release once it can: k3-pi (192.168.77.11, port 22) " in shown
    swarm.start(PI)
    assert deploy.wait(60) == exit_codes.OK, deploy.communicate()
    assert FAST in params(swarm, PI, "k3")
    assert "gets the release" not in swarm.swarmctl("status", spec=changed).out


@contextmanager
def watching(swarm: LabSwarm, spec: Path) -> Iterator[subprocess.Popen[str]]:
    watch = swarm.begin("watch", "--every", "10", spec=spec)
    try:
        yield watch
        watch.send_signal(signal.SIGINT)
        assert watch.wait(60) == exit_codes.OK, watch.communicate()
    finally:
        watch.kill()
        watch.wait()


def test_watch_deploys_what_is_edited_and_keeps_what_is_newer(swarm: LabSwarm) -> None:
    spec, later = swarm.variant("watched"), swarm.variant("later", (K3, SLOWER_K3))
    before = spec.read_text()
    with watching(swarm, spec) as watch:
        swarm.kill(PI)
        spec.write_text(before.replace("mode: leader", "mode: nothing"))
        spec.write_text(before.replace(K3, FASTER_K3))
        swarm.start(PI)
        until(lambda: FAST in params(swarm, PI, "k3"), "k3-pi is not brought to the edited spec")
        until(lambda: swarm.deploy(later).status == exit_codes.OK, "its deploy does not end")
        assert watch.stdout is not None
        assert any(line.startswith("k3-pi  newer: release ") for line in iter(watch.stdout.readline, ""))
        assert "linear_max: 0.05" in params(swarm, PI, "k3")


def test_no_host_is_changed_while_its_robot_drives(swarm: LabSwarm) -> None:
    changed = swarm.variant("when-idle", (K3, FASTER_K3), (KOALA, SLOWER_KOALA))
    with swarm.publishing(LEADER, "k3", 0.05) as publisher:
        until(lambda: moves(swarm.robot("k3")), "k3 does not drive")
        deploy = swarm.begin("deploy", "--yes", "--when-seen", "--healthy-for", "0.5", spec=changed)
        assert deploy.stderr is not None
        waits = "waiting, since k3-pi has a robot that must not be touched now; Ctrl-C ends it\n"
        assert waits in iter(deploy.stderr.readline, ""), "it does not wait"
        assert "linear_max: 0.1" in params(swarm, LEADER, "koala")
        assert FAST not in params(swarm, PI, "k3")
        publisher.kill()
        assert deploy.wait(60) == exit_codes.OK, deploy.communicate()
    assert FAST in params(swarm, PI, "k3")
