"""What ends a trial early: messages as the tools of ROS print them, from the start on."""

from __future__ import annotations

import pytest

from swarmctl.cli.trial_topics import LiveTopics
from swarmctl.spec.experiment_model import Criterion

POSE = "{position: {x: %g, y: %g, z: 0.0}, orientation: {x: 0.0, y: 0.0, z: 0.0, w: 1.0}}"
ODOMETRY = f"header: {{seq: 1}}\nchild_frame_id: base_link\npose: {{covariance: [0.0], pose: {POSE}}}"
GOAL = {"topic": "k3/odom", "reached": {"x": 1.0, "y": 0.0}}


def live(*criteria: dict[str, object]) -> LiveTopics:
    return LiveTopics([Criterion.model_validate(one) for one in criteria])


@pytest.fixture(autouse=True)
def _slowly(monkeypatch: pytest.MonkeyPatch) -> None:
    """Messages come once in a second."""
    times = iter(range(100))
    monkeypatch.setattr("swarmctl.cli.trial_topics.time.monotonic", lambda: float(next(times)))
    monkeypatch.setattr("swarmctl.cli.trial_topics._SHARE", 0.0)


def test_odometry_counts_from_the_start_of_the_trial() -> None:
    topics = live(GOAL)
    topics.add("/k3/odom", ODOMETRY % (6.0, 0.0))
    topics.add("/k3/odom", ODOMETRY % (7.0, 0.0))
    assert topics.met
    topics.begin()
    topics.add("/k3/odom", ODOMETRY % (7.0, 0.0))
    assert not topics.met
    topics.add("/k3/odom", ODOMETRY % (8.0, 0.05))
    assert topics.met


@pytest.mark.parametrize(
    "message",
    [f"pose: {{pose: {POSE}}}", f"pose: {POSE}", POSE, "{x: %g, y: %g, theta: 0.0}"],
    ids=["with covariance", "stamped", "pose", "2D"],
)
def test_other_poses_count_as_they_are(message: str) -> None:
    topics = live(GOAL)
    topics.add("/k3/odom", message % (2.0, 0.0))
    assert not topics.met
    topics.add("/k3/odom", message % (0.95, 0.0))
    assert topics.met


@pytest.mark.parametrize(
    "message", ["data: 3", "pose: {position: {x: .nan, y: 0, z: 0}}", "a: [", "", "- 1", "pose: 3"]
)
def test_whatever_comes_counts_and_nothing_else(message: str) -> None:
    topics = live({"topic": "k3/odom", "count": 2}, {"topic": "k3/odom", "distance": 0.1})
    for _ in range(2):
        topics.add("/k3/odom", message)
    assert not topics.met
    counted = live({"topic": "k3/odom", "count": 2})
    for _ in range(2):
        assert not counted.met
        counted.add("/k3/odom", message)
    assert counted.met


@pytest.mark.parametrize(
    "message",
    [
        "[" * 30_000,
        "".join(f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]\n" for n in range(1, 9)),
        "&a {pose: *a}",
        "\n".join(f"{' ' * n}pose:" for n in range(900)),
        f"pose: {{position: {{x: 1{'0' * 400}, y: 0}}, orientation: {{x: 0, y: 0, z: 0, w: 1}}}}",
        f"data: [{'1.0, ' * 100_000}]",
    ],
    ids=["nested", "aliases", "itself", "deep", "number", "long"],
)
def test_a_hostile_message_ends_nothing(message: str) -> None:
    topics = live(GOAL)
    topics.add("/k3/odom", message)
    assert not topics.met
    topics.add("/k3/odom", f"pose: {POSE}" % (1.0, 0.0))
    assert topics.met


def test_all_of_the_criteria_are_met_at_the_end() -> None:
    topics = live({"topic": "k3/odom", "count": 1}, {"topic": "koala/odom", "distance": 0.5})
    topics.add("/k3/odom", ODOMETRY % (0.0, 0.0))
    for x in (0.0, 0.3):
        topics.add("/koala/odom", ODOMETRY % (x, 0.0))
        assert not topics.met
    topics.add("/koala/odom", ODOMETRY % (0.6, 0.0))
    assert topics.met


def test_without_a_criterion_nothing_ends_it() -> None:
    assert not live().met
