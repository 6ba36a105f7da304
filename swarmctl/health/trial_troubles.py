"""What broke in a trial, by a look at the swarm before and after it. Pure."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from swarmctl.health.swarm_health import Look, Unit
from swarmctl.health.verdict import State


def in_it(before: Look, after: Look, programs: Collection[str]) -> Iterator[str]:
    """Yields what broke in a trial that has started ``programs``, also if it works again."""
    drivers, now = _drivers(before), _drivers(after)
    for name, unit in drivers.items():
        if unit is not None and (seen := now.get(name)) is not None and seen.pid != unit.pid:
            yield f"the driver of {name} ended in the trial, and was started again"
    for host in after.status.hosts:
        for program in host.programs:
            if program.name in programs and program.unit is not None and program.unit.restarts:
                yield f"program {program.name} ended in the trial, and was started again"
    yield from _skipped(after, programs)
    if not after.status.diagnosis.healthy:
        yield _cause(after)


def _drivers(look: Look) -> dict[str, Unit | None]:
    return {robot.name: robot.driver for host in look.status.hosts for robot in host.robots}


def _skipped(look: Look, programs: Collection[str]) -> Iterator[str]:
    """The programs that do not run, as they are optional and their hosts lack something."""
    for finding in look.status.diagnosis.findings:
        if finding.check == "program" and finding.state is State.SKIPPED and finding.program in programs:
            yield f"program {finding.program} {finding.message}"


def _cause(look: Look) -> str:
    finding = look.status.causes()[0][0]
    return f"{finding.key}: {finding.message}"
