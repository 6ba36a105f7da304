"""Trials and their samples as data frames."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from swarmctl.capsule.capsule_index import CapsuleError
from swarmctl.capsule.folder import write as write_index
from swarmctl.capsule.frames import samples, trials
from tests.capsule.trial_folder import ABOUT
from tests.ui.bag_files import BEGAN, odometry, write

GOAL = {"topic": "k3/odom", "condition": "reached", "wanted": 0.1, "found": 0.4, "met": False}
JUDGED = [GOAL, GOAL | {"found": None}, GOAL | {"condition": "count", "found": 12}]


def capsule(folder: Path, **changes: object) -> Path:
    (folder / "spec").mkdir(parents=True)
    (folder / "bags").mkdir()
    for name in ABOUT["spec"]:
        (folder / name).touch()
    write(folder / "bags/k3-pi_0.bag", [(1.5, *odometry(1.0, 2.0, math.pi / 2, speed=0.5, robot="k3"))])
    host = ABOUT["hosts"]["k3-pi"] | {"began": BEGAN + 7.0}  # by a clock that is ahead
    moments = {"began": BEGAN, "ended": BEGAN + 60.5, "hosts": {"k3-pi": host}}
    write_index(folder, ABOUT | moments | changes)
    return folder


def test_a_trial_is_a_row(tmp_path: Path) -> None:
    first = capsule(tmp_path / "a/1", parameters={"wander": {"speed": 0.1, "modes": [1, 2]}}, git=None)
    second = capsule(
        tmp_path / "a/2", success=False, judged=JUDGED, outcome="failed", cause="k3 fell", skew=None
    )
    frame = trials([str(tmp_path / "a"), first])
    assert list(frame.columns) == [
        "folder", "swarm", "experiment", "trial", "began", "seconds", "outcome", "cause", "success", "skew",
        "operator", "commit", "wander.speed", "wander.modes",
        "k3/odom reached", "k3/odom reached 2", "k3/odom count",
    ]  # fmt: skip
    one, other = frame.astype(object).where(frame.notna(), None).to_dict("records")
    assert one == {
        "folder": str(first), "swarm": "lab", "experiment": "circle", "trial": 3,
        "began": BEGAN, "seconds": 60.5, "outcome": "completed", "cause": "", "success": True,
        "skew": 0.0042, "operator": "ada@desk", "commit": None,
        "wander.speed": 0.1, "wander.modes": "[1, 2]",
        "k3/odom reached": None, "k3/odom reached 2": None, "k3/odom count": None,
    }  # fmt: skip
    assert (other["folder"], other["success"], other["commit"], other["skew"]) == (
        str(second),
        False,
        "5" * 40,
        None,
    )
    assert (other["k3/odom reached"], other["k3/odom reached 2"], other["k3/odom count"]) == (0.4, None, 12)


def test_a_sample_is_a_row(tmp_path: Path) -> None:
    one = capsule(tmp_path / "1")
    frame = samples([one])
    assert list(frame.columns) == ["folder", "topic", "t", "x", "y", "yaw", "speed"]
    (row,) = frame.itertuples(index=False)
    assert row[:2] == (str(one), "/k3/odom")
    assert row[2:] == pytest.approx((1.5 - 7.0, 1.0, 2.0, math.pi / 2, 0.5))


def test_nothing_has_the_same_columns(tmp_path: Path) -> None:
    assert (len(trials([])), len(samples([]))) == (0, 0)
    assert list(trials([]).columns)[:2] == ["folder", "swarm"]
    assert list(samples([]).columns)[:2] == ["folder", "topic"]
    with pytest.raises(CapsuleError, match="is not a capsule"):
        trials([tmp_path])


def test_a_damaged_bag_is_a_warning(tmp_path: Path) -> None:
    one = capsule(tmp_path / "1")
    (one / "bags/b.bag").write_text("no bag")
    with pytest.warns(UserWarning, match=r"b\.bag is not read: it is damaged"):
        assert len(samples([one])) == 1
