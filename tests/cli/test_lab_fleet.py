"""The example of a lab's fleet: 40 hosts are rendered with little work, and a plan of them can be read."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from tests import ROOT
from tests.loading import load_swarm
from tests.timing import work_at_most

SPEC = ROOT / "examples/lab-fleet/swarm.yaml"
KINDS = {
    "turtlebot3-burger": 20,
    "pioneer3": 10,
    "epuck2": 12,
    "arduino-rover": 6,
    "cart": 1,
    "mavros-px4": 1,
}


@pytest.fixture(autouse=True)
def nothing_deployed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setenv("NO_COLOR", "1")


def test_it_has_fifty_robots_of_six_kinds_on_forty_hosts() -> None:
    swarm, _ = load_swarm(SPEC)
    assert swarm is not None
    types = [robot.type_name for robot in swarm.robots.values()]
    assert {name: types.count(name) for name in types} == KINDS
    assert len(swarm.hosts) == 40


def test_it_needs_no_ignored_finding() -> None:
    texts = [path.read_text("utf-8") for path in SPEC.parent.glob("*.yaml")]
    assert not [text for text in texts if "swarmctl: ignore" in text or "ignore:" in text]


def test_forty_hosts_are_rendered_with_little_work(tmp_path: Path) -> None:
    with work_at_most(1000):
        assert run(["render", str(SPEC), "--out", str(tmp_path / "out")]) == exit_codes.OK
    assert len(list((tmp_path / "out").iterdir())) == 40


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["graph", "--paths"], "98 paths, equal ones as one line (--details: each of them)"),
        (["graph", "--budgets"], "tb3-[01-20]     raspberry-pi-3b  300 of 1024 MB"),
        (["graph", "--budgets"], "epuck-[01-12]  bluetooth, 115200 baud  1160 of 11520 B/s"),
        (["render", "--out", "out"], "tb3-[01-20]     one each "),
        (["mode", "infer"], "also on `epuck-pi-[1-2]`, `p3-[01-10]`, `rover-pi-[1-6]`, `uav-pi`"),
    ],
)
def test_equal_hosts_and_robots_share_a_line(
    arguments: list[str],
    line: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run([*arguments, str(SPEC)]) == exit_codes.OK
    shown = capsys.readouterr().out
    assert line in shown
    assert len(shown.splitlines()) < 30


def test_details_of_a_graph_show_each_path(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["graph", str(SPEC), "--paths", "--details"]) == exit_codes.OK
    shown = capsys.readouterr().out.splitlines()
    assert len(shown) == 98
    assert sum("robot tb3-07 " in line for line in shown) == 2


def test_changes_that_a_conversion_leaves_to_people_are_ranges(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["mode", "convert", str(SPEC), "--to", "single-minded"]) == exit_codes.ERROR
    shown = capsys.readouterr().err
    assert "links[1-28,30].host: desk; links[14-16,20-22].adapter removed; robots.tb3-[01-20].host" in shown


def test_a_plan_folds_equal_hosts(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["plan", str(SPEC), "--offline"]) == exit_codes.OK
    shown = capsys.readouterr().out
    for hosts in ("tb3-[01-20]  20", "p3-[01-10]  10", "rover-pi-[1-6]  6"):
        assert f"\n{hosts} hosts like " in shown
    assert len(shown.splitlines()) < 150
