"""Labs that are interrupted, killed and taken down: whatever happens, ``down`` leaves nothing."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from lab_values import SPEC, plan_from
from tiny_labs import SWARMCTL, booted, in_a_lab, left_of, machine, on, quiet, until

from swarmctl.lab import lab, launch, places, processes
from swarmctl.lab.errors import LabError
from swarmctl.lab.plan import LabPlan


@pytest.fixture
def plan(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[LabPlan]:
    """A lab of one host, in a state folder of this test's own, where nothing is left at the end."""
    monkeypatch.setenv(places.STATE_VARIABLE, str(tmp_path / "state"))
    whole = plan_from(tmp_path)
    plan = replace(whole, hosts=whole.hosts[:1], robots=whole.robots[:1])
    yield plan
    lab.down(plan.name)


@in_a_lab
def test_down_leaves_nothing(plan: LabPlan) -> None:
    before, place = machine(), places.home(plan.name)
    lab.up(plan, quiet)
    assert len(left_of(place)) > 3
    assert lab.down(plan.name) is True
    assert left_of(place) == []
    assert machine() == before
    assert lab.down(plan.name) is False


@in_a_lab
@pytest.mark.parametrize("which", [0, -1], ids=["outermost", "innermost"])
def test_a_killed_supervisor_takes_everything_with_it_and_up_mends_it(plan: LabPlan, which: int) -> None:
    lab.up(plan, quiet)
    on(plan.name, "alpha", "echo kept > kept; sync")
    place = places.home(plan.name)
    os.kill(sorted(launch.running(place))[which], signal.SIGKILL)
    inside = [places.NAMESPACES / name for name in place.namespaces()]
    until(lambda: not processes.in_network_namespaces(inside), "hosts outlive their supervisor", 5.0)
    assert lab.status(plan.name)["running"] is False
    with pytest.raises(LabError, match="is not running") as refusal:
        lab.robots(plan.name)
    assert "lab up" in refusal.value.help_lines[0]
    lab.up(plan, quiet)
    assert on(plan.name, "alpha", "cat kept") == "kept"
    os.kill(launch.running(place)[0], signal.SIGKILL)
    lab.down(plan.name)
    assert left_of(place) == []


@in_a_lab
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT], ids=["killed", "ctrl-c"])
@pytest.mark.parametrize("moment", ["image:", "disks:", "network:", "supervisor:"])
def test_an_up_that_breaks_off(plan: LabPlan, tmp_path: Path, moment: str, number: signal.Signals) -> None:
    (tmp_path / "tiny.yaml").write_text(SPEC)
    with subprocess.Popen(
        (SWARMCTL, "lab", "up", tmp_path / "tiny.yaml"), stderr=subprocess.PIPE, text=True
    ) as up:
        assert up.stderr is not None
        for line in up.stderr:
            if line.startswith(moment):
                up.send_signal(number)
                break
        said = up.stderr.read()
    assert up.returncode == (130 if number == signal.SIGINT else -signal.SIGKILL)
    assert "Traceback" not in said
    lab.down("tiny")
    assert left_of(places.home("tiny")) == []


@in_a_lab
def test_what_broke_off_is_completed_by_the_next_up(plan: LabPlan) -> None:
    def break_off(line: str) -> None:
        if line.startswith("disks:"):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        lab.up(plan, break_off)
    lab.up(plan, quiet)
    on(plan.name, "alpha", "true")


@in_a_lab
def test_down_all_keeps_to_its_state_folder(
    plan: LabPlan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lab.up(plan, quiet)
    here, elsewhere = places.home(plan.name), str(tmp_path / "elsewhere")
    with monkeypatch.context() as patch:
        patch.setenv(places.STATE_VARIABLE, elsewhere)
        with booted(plan):
            there = places.home(plan.name)
            done = subprocess.run(
                (SWARMCTL, "lab", "down", "--all"), capture_output=True, text=True, check=False
            )
            assert (done.returncode, done.stderr) == (0, "lab tiny: removed\n")
            assert left_of(there) == []
    assert launch.asked(here) is not None
    on(plan.name, "alpha", "true")


@in_a_lab
def test_a_host_that_cannot_boot_is_told_with_its_last_words(plan: LabPlan) -> None:
    broken = replace(plan, name="broken")
    try:
        with pytest.raises(LabError, match="host alpha did not start") as failure:
            lab.up(broken, lambda line: _without_init(line, "broken"))
        assert failure.value.help_lines
    finally:
        lab.down("broken")
    assert left_of(places.home("broken")) == []


def _without_init(line: str, name: str) -> None:
    if line.startswith("disks:"):
        upper = places.home(name).host("alpha").upper
        for path in ("usr/lib/systemd/systemd", "usr/sbin/init"):
            (upper / path).parent.mkdir(parents=True, exist_ok=True)
            os.mknod(upper / path, 0o600, os.makedev(0, 0))  # as overlayfs marks what was removed
