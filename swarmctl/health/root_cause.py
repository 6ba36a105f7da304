"""Root cause analysis: findings, each linked to its cause, and symptoms folded under a cause. Pure."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from swarmctl.health.checks import State, Verdict
from swarmctl.health.expected_graph import ExpectedHost, ExpectedRobot
from swarmctl.health.expected_programs import ExpectedProgram

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
    """Collects findings and links each to its cause."""

    def __init__(self) -> None:
        self.by_key: dict[str, Finding] = {}

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
        judged = verdict.bearable() if owner is not None and owner.optional else verdict
        finding = Finding(
            check,
            subject,
            judged.state,
            judged.message,
            judged.hint,
            host=part.host if part else host.name if host else "",
            robot=robot.name if robot else "",
            program=program.name if program else "",
            cause=None if judged.fine else self._root_of(after),
        )
        self.by_key[finding.key] = finding
        return finding.key

    def _root_of(self, keys: Iterable[str]) -> str | None:
        for key in keys:
            one = self.by_key.get(key)
            if one is not None and one.state is not State.OK:
                return one.cause or one.key
        return None
