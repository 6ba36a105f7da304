"""The health of a swarm as metrics of Prometheus. What was not measured has no sample, never a 0.

Text of hosts is made printable and cut, and a host has at most `MOST_FINDINGS` findings here, so that no host
can fill the database of Prometheus.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Sequence

from prometheus_client import CollectorRegistry, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from swarmctl.health.root_cause import Finding
from swarmctl.health.swarm_health import HostRow, Look, Status, TopicRow
from swarmctl.health.verdict import State
from swarmctl.views.escape import printable
from swarmctl.views.status import NOBODY

MOST_FINDINGS = 100  # of a host
_LONGEST = 120  # letters of a label, before what keeps it different from others
_SEVERITY = tuple(State)
_SHOWN = (State.WARNING, State.UNKNOWN, State.BAD)

Samples = Iterable[tuple[Sequence[str], float | None]]  # the values of the labels; None: not measured


class LastLook(Collector):
    """What ``/metrics`` serves: the last look at the swarm, nothing before the first one."""

    def __init__(self) -> None:
        self.look: Look | None = None

    def collect(self) -> Iterable[Metric]:
        """Returns the metrics of the last look."""
        look = self.look
        return () if look is None else metrics(look)


def registry(last: LastLook) -> CollectorRegistry:
    """Returns a registry with the metrics of the swarm alone, none of this process."""
    found = CollectorRegistry()
    found.register(last)
    return found


def render(look: Look) -> bytes:
    """Returns the metrics in the text format of Prometheus, as the node exporter reads it from a file."""
    last = LastLook()
    last.look = look
    return generate_latest(registry(last))


def metrics(look: Look) -> Iterator[Metric]:
    """Yields each metric that has a sample; samples are in the order of the spec."""
    for metric, samples in _families(look):
        by_labels: dict[tuple[str, ...], float] = {}
        for labels, value in samples:
            if value is not None:  # Prometheus refuses a second sample with the same labels
                by_labels.setdefault(tuple(map(_label, (look.status.swarm, *labels))), value)
        for shown, value in by_labels.items():
            metric.add_metric(shown, value)
        if metric.samples:
            yield metric


def _label(text: str) -> str:
    """A label that is safe to show and not too long; long ones that begin alike stay different."""
    shown = printable(text)
    if len(shown) <= _LONGEST:
        return shown
    return f"{shown[:_LONGEST]}~{hashlib.sha256(shown.encode()).hexdigest()[:8]}"


Family = tuple[GaugeMetricFamily | CounterMetricFamily, Samples]


def _gauge(name: str, text: str, labels: Sequence[str], samples: Samples) -> Family:
    return GaugeMetricFamily(name, text, labels=("swarm", *labels)), samples


def _families(look: Look) -> Iterator[Family]:
    status = look.status
    yield _gauge("swarm_healthy", "1 if the swarm is healthy.", (), [((), status.diagnosis.healthy)])
    yield _gauge(
        "swarm_look_timestamp_seconds", "When the look began, in s since 1970.", (), [((), look.began)]
    )
    yield _gauge("swarm_look_duration_seconds", "How long the look took.", (), [((), look.took)])
    yield from _of_findings(status.diagnosis.findings)
    for name, text, of_host in _of_hosts(status):
        yield _gauge(name, text, ("host",), [((host.name,), of_host(host)) for host in status.hosts])
    yield (
        CounterMetricFamily(
            "swarm_unit_restarts",
            "How often systemd restarted the unit since its last start by hand or by a deploy.",
            labels=("swarm", "host", "unit"),
        ),
        [
            ((host.name, name), unit.restarts)
            for host in status.hosts
            for name, unit in host.units.items()
            if unit.load != "not-found"
        ],
    )
    topics = [one for host in status.hosts for one in _topics(host)]
    for name, text, of_topic in _OF_TOPICS:
        labels = ("host", "robot", "program", "topic")
        yield _gauge(name, text, labels, [(owner, of_topic(topic)) for owner, topic in topics])
    yield _gauge(
        "swarm_robot_commander_info",
        "The commander that the robot obeys; none if it obeys nobody.",
        ("host", "robot", "commander"),
        [
            ((host.name, robot.name, robot.commander), 1)
            for host in status.hosts
            for robot in host.robots
            if robot.commander not in ("", NOBODY)
        ],
    )


def _of_findings(findings: Iterable[Finding]) -> Iterator[Family]:
    """The findings that are not ok; of a host with too many, causes and the worst ones."""
    by_host: dict[str, list[Finding]] = {}
    for one in findings:
        if one.state in _SHOWN:
            by_host.setdefault(one.host, []).append(one)
    for kept in by_host.values():
        kept.sort(key=lambda one: (one.cause is not None, -_SEVERITY.index(one.state)))
    yield _gauge(
        "swarm_finding",
        "A finding that is not ok, always 1. A symptom has the check and subject of its cause as cause.",
        ("check", "subject", "state", "host", "robot", "program", "cause"),
        [
            ((one.check, one.subject, one.state.value, host, one.robot, one.program, one.cause or ""), 1)
            for host, kept in by_host.items()
            for one in kept[:MOST_FINDINGS]
        ],
    )
    yield _gauge(
        "swarm_findings_left_out",
        f"How many more findings the host has: swarm_finding has at most {MOST_FINDINGS} of a host.",
        ("host",),
        [((host,), len(kept) - MOST_FINDINGS) for host, kept in by_host.items() if len(kept) > MOST_FINDINGS],
    )


def _of_hosts(status: Status) -> Iterator[tuple[str, str, Callable[[HostRow], float | None]]]:
    """Metrics of hosts: name, help, and the value for a host."""
    not_tried = {one.host for one in status.diagnosis.findings if one.check == "probed"}
    yield (
        "swarm_host_up",
        "1 if the host answered, 0 if it did not.",
        lambda host: None if host.name in not_tried else host.reachable,
    )
    yield (
        "swarm_host_release_as_expected",
        "1 if the host has the release that the spec renders, 0 if it has another one or none.",
        lambda host: None if host.deployed is None else host.release == host.expected_release,
    )
    yield "swarm_host_units_expected", "Units of the host's release.", lambda host: host.units_expected
    yield (
        "swarm_host_units_running",
        "Units of the host's release that run.",
        lambda host: host.units_running if len(host.units) == host.units_expected and host.units else None,
    )
    yield (
        "swarm_master_latency_seconds",
        "How long the ROS master takes to answer the host.",
        lambda host: host.master.latency if host.master and host.master.reachable else None,
    )


_OF_TOPICS: tuple[tuple[str, str, Callable[[TopicRow], float | None]], ...] = (
    ("swarm_topic_rate_hertz", "The rate of the topic, measured on its host.", lambda topic: topic.rate),
    ("swarm_topic_expected_rate_hertz", "The rate in the spec.", lambda topic: topic.expected or None),
    (
        "swarm_topic_last_message_age_seconds",
        "The age of the last message when the measurement ended.",
        lambda topic: topic.age,
    ),
)


def _topics(host: HostRow) -> Iterator[tuple[tuple[str, ...], TopicRow]]:
    """The topics of a host's robots and programs, with the values of their labels."""
    for robot in host.robots:
        for topic in robot.topics:
            yield (host.name, robot.name, "", topic.name), topic
    for program in host.programs:
        for topic in program.topics:
            yield (host.name, "", program.name, topic.name), topic
