"""Whether the messages of a trial show its success. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from swarmctl.capsule.capsule_index import Judged
from swarmctl.capsule.trajectory import RecordedTopic, nearest, path_length
from swarmctl.spec.experiment_model import Criterion
from swarmctl.swarm.topic_island import full_name

_MOST = 1e12  # of an amount in an index


def judge(criteria: Sequence[Criterion], seen: Mapping[str, RecordedTopic]) -> list[Judged]:
    """Returns each condition of the criteria, in their order, with what the bags show.

    ``seen`` has topics by their full names. A condition is not met by a topic without messages, and one
    about the motion by a topic without poses: nothing is found of it.
    """
    return [
        one
        for criterion in criteria
        for one in _judged(criterion, seen.get(full_name(criterion.topic), RecordedTopic()))
    ]


def _judged(criterion: Criterion, topic: RecordedTopic) -> Iterator[Judged]:
    path = topic.trajectory()
    if goal := criterion.reached:
        found = _amount(nearest(path, goal.x, goal.y)) if path else None
        yield Judged(
            topic=criterion.topic, condition="reached", wanted=_amount(goal.within), found=found,
            met=found is not None and found <= goal.within,
        )  # fmt: skip
    if criterion.distance is not None:
        found = _amount(path_length(path)) if path else None
        yield Judged(
            topic=criterion.topic, condition="distance", wanted=_amount(criterion.distance), found=found,
            met=found is not None and found >= criterion.distance,
        )  # fmt: skip
    if criterion.count is not None:
        yield Judged(
            topic=criterion.topic, condition="count", wanted=_amount(criterion.count),
            found=_amount(topic.messages) if topic.messages else None, met=topic.messages >= criterion.count,
        )  # fmt: skip


def _amount(value: float) -> float:
    return min(value, _MOST)
