"""Root cause analysis: a graph of findings, in which each is linked to its cause. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import networkx as nx

from swarmctl.health.expected_graph import ExpectedHost, ExpectedProgram, ExpectedRobot
from swarmctl.health.verdict import State, Verdict

HOST = "host"


@dataclass(frozen=True)
class Finding:
    """The result of one check of one subject (a host, a unit, a robot, a topic).

    ``cause`` is the key of the finding that explains this one; ``host``, ``robot`` and ``program`` name its
    owner.
    """

    check: str
    subject: str
    state: State
    message: str
    hint: str = ""
    host: str = ""
    robot: str = ""
    program: str = ""
    cause: str | None = None

    @property
    def key(self) -> str:
        """The unique key of the finding: check and subject."""
        return f"{self.check} {self.subject}"


@dataclass(frozen=True)
class Diagnosis:
    """All findings, each after those that may explain it."""

    findings: tuple[Finding, ...]

    @property
    def troubles(self) -> tuple[Finding, ...]:
        """What makes a swarm unhealthy: every bad finding, and unknown ones without a cause."""
        return tuple(
            one
            for one in self.findings
            if one.state is State.BAD or (one.state is State.UNKNOWN and one.cause is None)
        )

    @property
    def healthy(self) -> bool:
        """True if there is no trouble."""
        return not self.troubles

    @property
    def only_unreachable(self) -> bool:
        """Whether unreachable hosts are the only problem."""
        return not self.healthy and all(one.check == HOST for one in self.troubles)

    def explained(self) -> tuple[tuple[Finding, tuple[Finding, ...]], ...]:
        """Returns every cause that is not ok, with its symptoms."""
        symptoms: dict[str, list[Finding]] = {}
        for one in self.findings:
            if one.cause is not None:
                symptoms.setdefault(one.cause, []).append(one)
        return tuple(
            (one, tuple(symptoms.get(one.key, ())))
            for one in self.findings
            if one.cause is None and one.state is not State.OK
        )


class Findings:
    """Collects findings about ``hosts`` and their parts, and what may explain each of them, in any order.

    They are the nodes of a graph whose edges lead from a finding to those that it may explain.
    """

    def __init__(self, hosts: Sequence[ExpectedHost]) -> None:
        robots = ((host.name, one.name, "") for host in hosts for one in host.robots)
        programs = ((host.name, "", one.name) for host in hosts for one in host.programs)
        owners = [("", "", ""), *((host.name, "", "") for host in hosts), *robots, *programs]
        self._rank = {owner: number for number, owner in enumerate(owners)}
        self._of_root = {host.name for host in hosts if host.account == "root"}
        self._graph: nx.DiGraph[str] = nx.DiGraph()
        self._filed: dict[str, Finding] = {}

    def add(
        self,
        check: str,
        subject: str,
        verdict: Verdict,
        *,
        host: ExpectedHost | None = None,
        robot: ExpectedRobot | None = None,
        program: ExpectedProgram | None = None,
        after: Iterable[str] = (),
    ) -> str:
        """Adds a verdict, returns its key. If not ok, its cause is the first in ``after`` that is not ok."""
        owner = robot or program or host
        part = robot or program
        place = part.host if part else host.name if host else ""
        judged = verdict.bearable() if owner is not None and owner.optional else verdict
        finding = Finding(
            check,
            subject,
            judged.state,
            judged.message,
            judged.hint.replace("sudo ", "") if place in self._of_root else judged.hint,
            host=place,
            robot=robot.name if robot else "",
            program=program.name if program else "",
        )
        self._filed[finding.key] = finding
        self._graph.add_node(finding.key)
        self._graph.add_edges_from((one, finding.key) for one in after)
        return finding.key

    def diagnosis(self) -> Diagnosis:
        """Returns all findings with their causes, each after those that may explain it.

        Else they stand in the order of the spec, hosts before robots, and programs last.
        """
        filed = sorted(self._filed.values(), key=lambda one: self._rank[one.host, one.robot, one.program])
        order = {one.key: number for number, one in enumerate(filed)}
        found: dict[str, Finding] = {}
        for key in nx.lexicographical_topological_sort(self._graph.subgraph(order), key=order.__getitem__):
            one = self._filed[key]
            reasons = (found[each] for each in self._graph.pred[key] if each in found)
            first = next((each for each in reasons if each.state is not State.OK), None)
            if one.state is not State.OK and first is not None:
                one = replace(one, cause=first.cause or first.key)
            found[key] = one
        return Diagnosis(tuple(found.values()))
