"""Labs that are interrupted, killed and taken down: whatever happens, ``down`` leaves nothing."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from swarmctl.lab import lab, paths, supervisor_client
from swarmctl.lab.errors import LabError
from swarmctl.lab.hosts import processes
from swarmctl.lab.lab_plan import LabPlan
from tests.lab.lab_values import SPEC, plan_from
from tests.lab.tiny_labs import (
    SWARMCTL,
    booted,
    in_a_lab,
    left_of,
    machine,
    on,
    quiet,
)
from tests.timing import wait_for


@pytest.fixture
def plan(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[LabPlan]:
    """A lab of one host, in a state folder of this test's own, where nothing is left at the end."""
    monkeypatch.setenv(paths.STATE_VARIABLE, str(tmp_path / "state"))
    whole = plan_from(tmp_path)
    plan = replace(whole, hosts=whole.hosts[:1], robots=whole.robots[:1])
    yield plan
    lab.down(plan.name)


@in_a_lab
def test_down_leaves_nothing(plan: LabPlan) -> None:
    before, place = machine(), paths.lab_paths(plan.name)
    lab.up(plan, quiet)
    assert len(left_of(place)) > 3
    assert lab.down(plan.name) is True
    assert left_of(place) == []
    assert machine() == before
    assert lab.down(plan.name) is False


@in_a_lab
@pytest.mark.parametrize("which", [0, -1], ids=["outermost", "innermost"])
def test_killing_the_supervisor_ends_the_lab_and_up_restores_it(plan: LabPlan, which: int) -> None:
    lab.up(plan, quiet)
    on(plan.name, "alpha", "echo kept > kept; sync")
    place = paths.lab_paths(plan.name)
    os.kill(sorted(supervisor_client.pids(place))[which], signal.SIGKILL)
    inside = [paths.NAMESPACES / name for name in place.namespaces()]
    wait_for(lambda: not processes.in_network_namespaces(inside), complaint="hosts outlive their supervisor")
    assert lab.status(plan.name)["running"] is False
    with pytest.raises(LabError, match="is not running") as refusal:
        lab.robots(plan.name)
    assert "lab up" in refusal.value.help_lines[0]
    lab.up(plan, quiet)
    assert on(plan.name, "alpha", "cat kept") == "kept"
    os.kill(supervisor_client.pids(place)[0], signal.SIGKILL)
    lab.down(plan.name)
    assert left_of(place) == []


@in_a_lab
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT], ids=["killed", "ctrl-c"])
@pytest.mark.parametrize("moment", ["image:", "disks:", "network:", "supervisor:"])
def test_an_interrupted_up(plan: LabPlan, tmp_path: Path, moment: str, number: signal.Signals) -> None:
    (tmp_path / "tiny.yaml").write_text(SPEC)
    with subprocess.Popen(
        (SWARMCTL, "lab", "up", tmp_path / "tiny.yaml"), stderr=subprocess.PIPE, text=True
    ) as up:
        assert up.stderr is not None
        for line in up.stderr:
            if line.startswith(moment):
                up.send_signal(number)
                break
        output = up.stderr.read()
    assert up.returncode == (130 if number == signal.SIGINT else -signal.SIGKILL)
    assert "Traceback" not in output
    lab.down("tiny")
    assert left_of(paths.lab_paths("tiny")) == []


@in_a_lab
def test_an_interrupted_up_is_completed_by_the_next(plan: LabPlan) -> None:
    def break_off(line: str) -> None:
        if line.startswith("disks:"):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        lab.up(plan, break_off)
    lab.up(plan, quiet)
    on(plan.name, "alpha", "true")


@in_a_lab
def test_down_all_affects_only_its_state_folder(
    plan: LabPlan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lab.up(plan, quiet)
    here, elsewhere = paths.lab_paths(plan.name), str(tmp_path / "elsewhere")
    with monkeypatch.context() as patch:
        patch.setenv(paths.STATE_VARIABLE, elsewhere)
        with booted(plan):
            there = paths.lab_paths(plan.name)
            done = subprocess.run(
                (SWARMCTL, "lab", "down", "--all"), capture_output=True, text=True, check=False
            )
            assert (done.returncode, done.stderr) == (0, "lab tiny: removed\n")
            assert left_of(there) == []
    assert supervisor_client.status(here) is not None
    on(plan.name, "alpha", "true")


@in_a_lab
def test_a_host_that_cannot_boot_is_reported_with_its_log(plan: LabPlan) -> None:
    broken = replace(plan, name="broken")
    try:
        with pytest.raises(LabError, match="host alpha did not start") as failure:
            lab.up(broken, lambda line: _without_init(line, "broken"))
        assert failure.value.help_lines
    finally:
        lab.down("broken")
    assert left_of(paths.lab_paths("broken")) == []


def _without_init(line: str, name: str) -> None:
    if line.startswith("disks:"):
        upper = paths.lab_paths(name).host("alpha").upper
        for path in ("usr/lib/systemd/systemd", "usr/sbin/init"):
            (upper / path).parent.mkdir(parents=True, exist_ok=True)
            os.mknod(upper / path, 0o600, os.makedev(0, 0))  # as overlayfs marks what was removed
