"""A plan in a file is executed as it was made, or refused with what has changed."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from swarm_onboard.agent.steps import Kind, Step

from swarmctl.cli import saved_plan
from swarmctl.cli.app import run
from swarmctl.cli.spec_args import SpecFiles
from swarmctl.cli.where import Where
from swarmctl.plan.plan import HostPlan, Plan, Problem

STEP = Step(Kind.UPDATE, "params/k3.yaml", "changed, from robots.k3")
K3 = HostPlan("k3", "a", "b", (STEP,), last="t1")
DESK = HostPlan("desk", "c", "c", last="t2")
MADE = Plan("new", (K3, DESK))


def saved(tmp_path: Path, **more: object) -> saved_plan.SavedPlan:
    (tmp_path / "lab").mkdir(exist_ok=True)
    files = (tmp_path / "swarm.yaml", tmp_path / "lab/night.yaml")
    values = {"lab": True, "lab_name": "b", "limit": ["k*"], **more}
    where = Where(SpecFiles(files), **values)  # type: ignore[arg-type]
    made = saved_plan.SavedPlan(where, saved_plan.hosts_of(MADE))
    made.write(tmp_path / "lab/monday.plan")
    found = saved_plan.read(SpecFiles((tmp_path / "lab/monday.plan",)))
    assert found == made
    return found


@pytest.mark.parametrize(
    ("now", "reason"),
    [
        (MADE, ""),
        (Plan("new", (DESK, K3)), ""),
        (Plan("new", (K3, replace(DESK, notes=("a note",)))), ""),
        (Plan("new", (K3,)), "the spec has other hosts now"),
        (Plan("new", (replace(K3, next="d"), DESK)), "the spec has changed: k3 would get release d, not b"),
        (Plan("new", (replace(K3, previous="d"), DESK)), "somebody has deployed to k3 since"),
        (Plan("new", (replace(K3, last="t3"), DESK)), "somebody has deployed to k3 since"),
        (Plan("new", (K3, replace(DESK, steps=(STEP,)))), "desk was changed by hand since"),
        (
            Plan("new", (K3, replace(DESK, problem=Problem("unreachable", "no route")))),
            "desk is unreachable now, and was fit",
        ),
    ],
)
def test_a_stale_plan_is_refused_with_the_reason(tmp_path: Path, now: Plan, reason: str) -> None:
    assert saved_plan.stale(saved(tmp_path), now) == reason


def test_a_spec_is_no_plan(tmp_path: Path) -> None:
    for text in ("version: 1\n", "{}", '{"format": "swarmctl plan 1"}', ""):
        (tmp_path / "swarm.yaml").write_text(text)
        assert saved_plan.read(SpecFiles((tmp_path / "swarm.yaml",))) is None
    assert saved_plan.read(SpecFiles((tmp_path / "missing.yaml",))) is None


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: text[:-9], "a damaged plan"),
        (lambda text: text.replace("plan 1", "plan 9"), "a plan of another version of swarmctl"),
        (lambda text: json.dumps({"format": "swarmctl plan 1"}, indent=1), "a damaged plan"),
        (lambda text: text.replace('"files": [', '"files": [3, '), "a damaged plan"),
    ],
)
def test_a_damaged_plan_is_an_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], change: object, message: str
) -> None:
    saved(tmp_path)
    path = tmp_path / "lab/monday.plan"
    path.write_text(change(path.read_text()))  # type: ignore[operator]
    assert run(["deploy", str(path)]) == 1
    shown = capsys.readouterr().err
    assert message in shown
    assert "make it again with `swarmctl plan -o`" in shown


@pytest.mark.parametrize("options", [["--limit", "desk"], ["--lab-name", "other"], ["-f", "night.yaml"]])
def test_options_that_contradict_the_plan_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[str]
) -> None:
    saved(tmp_path)
    assert run(["deploy", str(tmp_path / "lab/monday.plan"), *options]) == 64
    assert "the saved plan says which spec and hosts" in capsys.readouterr().err


def test_a_plan_without_hosts_cannot_be_saved(leader_spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["plan", str(leader_spec), "--offline", "-o", "x.plan"]) == 64
    assert "--offline and --out exclude each other" in capsys.readouterr().err
