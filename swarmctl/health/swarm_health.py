"""The health of a swarm as one value: a row per host and per robot, and the findings. Pure."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Annotated, Any, Literal, get_type_hints

from pydantic import (
    AfterValidator,
    BaseModel,
    GetCoreSchemaHandler,
    TypeAdapter,
    ValidationError,
    create_model,
)
from swarm_onboard.agent.observations import MasterSeen, NodeSeen
from swarm_onboard.agent.systemd import UnitState
from swarm_onboard.agent.verbs.probe import Answer

from swarmctl.health import launched_nodes
from swarmctl.health.checks import authority, topic
from swarmctl.health.checks import program as programs
from swarmctl.health.checks.bridge import CHECK
from swarmctl.health.expected_graph import ExpectedGraph, ExpectedHost, ExpectedProgram, ExpectedRobot
from swarmctl.health.root_cause import Diagnosis, Finding
from swarmctl.health.verdict import State
from swarmctl.remote.transport import HostError
from swarmctl.swarm.topics import DriverTopic


class _Object:
    """The type of a named tuple that is an object in JSON, and in the schema of that."""

    def __get_pydantic_core_schema__(self, kind: Any, handler: GetCoreSchemaHandler) -> Any:
        """Returns what pydantic reads it with."""
        fields: dict[str, Any] = {name: (one, ...) for name, one in get_type_hints(kind).items()}
        model = create_model(str(kind.__name__), **fields)
        return handler.generate_schema(Annotated[model, AfterValidator(lambda read: kind(**dict(read)))])


Unit = Annotated[UnitState, _Object()]
Master = Annotated[MasterSeen, _Object()]
_NONE = Answer()
_SEVERITY = tuple(State)


@dataclass(frozen=True)
class TopicRow:
    """A topic: the rate measured, if any, and the one expected, in Hz; the ``age`` of the last message, s."""

    name: str
    type: str
    rate: float | None
    expected: float
    age: float | None = None


@dataclass(frozen=True)
class RobotRow:
    """A robot. ``driver`` is its unit, ``report`` the driver's status, ``commander`` the one it obeys now.

    ``commanders`` are the authorised nodes that publish on its command topic.
    """

    name: str
    namespace: str  # in ROS, without a slash in front
    state: State
    driver: Unit | None
    node: str
    registered: bool | None
    alive: bool | None
    report: str
    device: str
    device_exists: bool | None
    topics: tuple[TopicRow, ...]
    commander: str
    commanders: tuple[str, ...] | None


@dataclass(frozen=True)
class ProgramRow:
    """A program: its unit, its nodes as far as they are known, the topics with a declared rate."""

    name: str
    state: State
    unit: Unit | None
    node: str
    alive: bool | None
    topics: tuple[TopicRow, ...] = ()


@dataclass(frozen=True)
class BridgeRow:
    """A topic that a hub receives from another island."""

    topic: str
    type: str
    origin: str
    state: State
    message: str


@dataclass(frozen=True)
class HostRow:
    """A host, and whether it ``has_master`` to reach. The rest is known only of a ``reachable`` one.

    ``deployed``: whether it has a release of the swarm; None if that is not known.
    """

    name: str
    address: str
    state: State
    reachable: bool
    is_hub: bool
    has_master: bool
    release: str | None
    expected_release: str
    units: Mapping[str, Unit]
    units_expected: int
    master: Master | None
    robots: tuple[RobotRow, ...]
    bridges: tuple[BridgeRow, ...] = ()
    programs: tuple[ProgramRow, ...] = ()
    deployed: bool | None = None

    @property
    def units_running(self) -> int:
        """The number of units that run."""
        return sum(unit.runs for unit in self.units.values())


@dataclass(frozen=True)
class Status:
    """The whole swarm at one moment."""

    swarm: str
    hosts: tuple[HostRow, ...]
    diagnosis: Diagnosis

    def causes(self) -> list[tuple[Finding, tuple[Finding, ...]]]:
        """Returns every cause that is not ok with its symptoms, the worst first.

        A cause is as bad as its worst symptom, as a warning may explain a fault. Of equally bad ones, hosts
        without a release stand first, then those with the most symptoms.
        """

        def rank(one: tuple[Finding, Sequence[Finding]]) -> tuple[int, bool, int]:
            cause, symptoms = one
            worst = max(_SEVERITY.index(each.state) for each in (cause, *symptoms))
            bare = self.is_bare(cause)
            return -worst, not bare, 0 if bare else -len(symptoms)

        return sorted(self.diagnosis.explained(), key=rank)

    @cached_property
    def bare(self) -> frozenset[str]:
        """The hosts that have no release: what is found on them follows from that."""
        return frozenset(host.name for host in self.hosts if host.deployed is False)

    def is_bare(self, cause: Finding) -> bool:
        """Returns True if ``cause`` is that a host has no release."""
        return cause.check == "release" and cause.host in self.bare

    def to_json(self) -> dict[str, Any]:
        """Returns what ``status --json`` prints."""
        return {
            "v": 1,
            "swarm": self.swarm,
            "healthy": self.diagnosis.healthy,
            "hosts": [_plain(asdict(host)) for host in self.hosts],
            "findings": [asdict(finding) | {"key": finding.key} for finding in self.diagnosis.findings],
        }

    @classmethod
    def from_json(cls, document: Any) -> Status:
        """The status that ``to_json`` has written as ``document``; ``ValueError`` for any other document."""
        try:
            diagnosis = {"findings": document["findings"]}
            value = {"swarm": document["swarm"], "hosts": document["hosts"], "diagnosis": diagnosis}
            read = TypeAdapter(cls).validate_python(value)
        except (TypeError, KeyError, ValidationError):
            read = None
        if read is None or json.loads(json.dumps(read.to_json())) != document:
            raise ValueError("this is not what status --json prints")
        return read


def _plain(value: Any) -> Any:
    """Returns a value for JSON, in which a named tuple is an object."""
    if isinstance(value, tuple) and hasattr(value, "_asdict"):
        value = value._asdict()
    if isinstance(value, dict):
        return {name: _plain(one) for name, one in value.items()}
    return [_plain(one) for one in value] if isinstance(value, list | tuple) else value


@dataclass(frozen=True)
class Look:
    """A status, with when its look at the hosts ``began``, s since 1970, and how many s it ``took``."""

    status: Status
    began: float
    took: float


def status(graph: ExpectedGraph, outcomes: Mapping[str, Answer | HostError], diagnosis: Diagnosis) -> Status:
    """Rows for every host and robot of ``graph``, each with its worst state."""
    worst: dict[tuple[str, str], State] = {}
    for finding in diagnosis.findings:
        if finding.state is not State.SKIPPED:
            owner = _owner(finding)
            worst[owner] = max(worst.get(owner, State.OK), finding.state, key=_SEVERITY.index)
    answers = {name: one for name, one in outcomes.items() if isinstance(one, Answer)}
    bridges = _bridges(graph, diagnosis)
    hosts = (
        replace(
            _host(host, answers.get(host.name), worst, answers.get(host.hub)),
            bridges=tuple(bridges.get(host.name, ())),
        )
        for host in graph.hosts
    )
    return Status(graph.swarm, tuple(hosts), diagnosis)


def _owner(finding: Finding) -> tuple[str, str]:
    """The row that a finding belongs to."""
    if finding.robot:
        return "robot", finding.robot
    return ("program", finding.program) if finding.program else ("host", finding.host)


def _bridges(graph: ExpectedGraph, diagnosis: Diagnosis) -> dict[str, list[BridgeRow]]:
    """By hub, the topics bridged to it and their state."""
    by_subject = {one.subject: one for one in diagnosis.findings if one.check == CHECK}
    rows: dict[str, list[BridgeRow]] = {}
    for one in graph.bridges:
        finding = by_subject[one.subject]
        row = BridgeRow(one.topic, one.type, one.origin, finding.state, finding.message)
        rows.setdefault(one.hub, []).append(row)
    return rows


def _host(
    host: ExpectedHost,
    answer: Answer | None,
    worst: Mapping[tuple[str, str], State],
    hub: Answer | None,
) -> HostRow:
    seen = answer or _NONE
    return HostRow(
        name=host.name,
        address=host.address,
        state=worst.get(("host", host.name), State.OK),
        reachable=answer is not None,
        is_hub=host.is_hub,
        has_master=bool(host.master_uri),
        release=seen.release,
        expected_release=host.release.digest,
        units={name: seen.units[name] for name in host.release.units if name in seen.units},
        units_expected=len(host.release.units),
        master=seen.master,
        robots=tuple(
            _robot(robot, seen, worst.get(("robot", robot.name), State.OK), hub) for robot in host.robots
        ),
        programs=tuple(_program(one, seen, worst.get(("program", one.name))) for one in host.programs),
        deployed=_deployed(answer),
    )


def _deployed(answer: Answer | None) -> bool | None:
    if answer is None or (answer.release is None and "release" in answer.troubles):
        return None
    return answer.release is not None


def _program(program: ExpectedProgram, answer: Answer, state: State | None) -> ProgramRow:
    unit, node = answer.units.get(program.unit), answer.nodes.get(program.node)
    launched = answer.launched.get(program.unit)
    skipped = unit is not None and unit.skipped
    return ProgramRow(
        name=program.name,
        state=state or (State.SKIPPED if skipped else State.OK),
        unit=unit,
        node=program.node or ", ".join(launched.starts if launched else ()),
        alive=node.alive if node else None,
        topics=tuple(_topic(one, programs.publisher(program, answer, one.name)) for one in program.measured),
    )


def _robot(robot: ExpectedRobot, answer: Answer, state: State, hub: Answer | None) -> RobotRow:
    node, guard = answer.nodes.get(robot.node), answer.nodes.get(robot.guard_node)
    device, launched = answer.devices.get(robot.device), answer.launched.get(robot.unit)
    return RobotRow(
        name=robot.name,
        namespace=robot.namespace,
        state=state,
        driver=answer.units.get(robot.unit),
        node=robot.node,
        registered=node.registered if node else None,
        alive=node.alive if node else None,
        report=guard.report.message if guard and guard.report else "",
        device=robot.device,
        device_exists=device.exists if device else None,
        topics=tuple(
            _topic(wanted, node or launched_nodes.publisher(wanted.name, launched)) for wanted in robot.topics
        ),
        commander=guard.report.commander if guard and guard.report else "",
        commanders=_commanders(robot, hub),
    )


def _commanders(robot: ExpectedRobot, hub: Answer | None) -> tuple[str, ...] | None:
    if hub is None or robot.command not in hub.commanders:
        return None
    found = authority.senders(robot, hub)
    return tuple(node for node, seen in found if authority.may_command(robot, node, seen))


def _topic(wanted: DriverTopic, node: NodeSeen | None) -> TopicRow:
    seen = node.topics.get(wanted.name) if node else None
    measured = seen is not None and not seen.error and not topic.too_slow(wanted, seen)
    rate = None if seen is None or not measured else 0.0 if not seen.count else seen.rate
    age = seen.age if seen is not None else None
    return TopicRow(
        wanted.name,
        wanted.type,
        None if rate is None else round(rate, 2),
        wanted.rate,
        None if age is None else round(age, 2),
    )


DIALECT = "https://json-schema.org/draft/2020-12/schema"


def status_schema() -> dict[str, Any]:
    """Returns the schema, in draft 2020-12."""
    finding = _model("Finding", {**get_type_hints(Finding), "key": str})
    keys = {"v": Literal[1], "swarm": str, "healthy": bool, "hosts": list[HostRow], "findings": list[finding]}  # type: ignore[valid-type]
    return {"$schema": DIALECT, **_model("Status", keys).model_json_schema(mode="serialization")}


def _model(name: str, keys: dict[str, Any]) -> type[BaseModel]:
    fields: dict[str, Any] = {key: (kind, ...) for key, kind in keys.items()}
    return create_model(name, **fields)
