"""``swarmctl exec`` and ``swarmctl ssh`` on the hosts of a lab."""

from __future__ import annotations

import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from swarmctl.lab import lab, paths
from swarmctl.lab.lab_plan import plan_of
from tests.child_process import child_process
from tests.lab.lab_values import SPEC, swarm_from
from tests.lab.tiny_labs import SWARMCTL, in_a_lab, quiet, succeeds
from tests.timing import PATIENCE, wait_for


@pytest.fixture
def spec(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The spec of a lab that is up."""
    monkeypatch.setenv(paths.STATE_VARIABLE, str(tmp_path / "state"))
    plan = plan_of(swarm_from(tmp_path, SPEC))
    lab.up(plan, quiet)
    yield tmp_path / "spec.yaml"
    lab.down(plan.name)


def swarmctl(verb: str, spec: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        (SWARMCTL, verb, spec, "--lab", *words),
        capture_output=True, text=True, check=False, timeout=PATIENCE, stdin=subprocess.DEVNULL,
    )  # fmt: skip


@in_a_lab
def test_a_command_on_hosts(spec: Path) -> None:
    done = swarmctl("exec", spec, "all", "--", "id -un; exit 5")
    assert done.stdout == "alpha, exit code 5\n    robot\nbeta, exit code 5\n    root\n"
    assert done.returncode == 5

    one = swarmctl("ssh", spec, "rover", "--", "hostname; echo e >&2; exit 4")
    assert (one.stdout, one.stderr.splitlines()[-1], one.returncode) == ("alpha\n", "e", 4)

    for command in ("sleep 9999", "sudo sleep 9999"):
        able = ("env", "--default-signal=INT")  # workers of pytest ignore Ctrl-C
        words = (*able, SWARMCTL, "exec", spec, "--lab", "-f", "*", "--", f"echo begun; {command}")
        with child_process(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as running:
            assert running.stdout is not None
            begun = sorted(running.stdout.readline() for _ in range(2))
            assert begun == ["alpha: begun\n", "beta: begun\n"]
            running.send_signal(signal.SIGINT)
            _, message = running.communicate(timeout=PATIENCE)
        assert running.returncode == 130
        assert "the command was ended on alpha, beta" in message
        for host in ("alpha", "beta"):
            wait_for(
                lambda host=host: not succeeds("tiny", host, "pgrep -f 'sleep [9]999'"),
                complaint=f"`{command}` goes on on {host}",
            )
