"""Compares the expected graph with the answers of the hosts: calls every check. Pure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from types import MappingProxyType
from typing import Protocol, cast

from swarm_onboard.agent.verbs.probe import Answer

from swarmctl.health import checks
from swarmctl.health.check_context import CheckContext
from swarmctl.health.expected_graph import ExpectedGraph
from swarmctl.health.name_conflicts import Launched
from swarmctl.health.root_cause import Diagnosis, Findings
from swarmctl.remote.transport import HostError


class Check(Protocol):
    """A module of ``swarmctl.health.checks``."""

    TABLE: Mapping[str, Sequence[tuple[str, str]]]

    def compare(self, found: Findings, context: CheckContext) -> None:
        """Files what it finds."""
        ...


@cache
def all_checks() -> tuple[Check, ...]:
    """Returns every check."""
    names = (one.name for one in iter_modules(checks.__path__, f"{checks.__name__}."))
    return tuple(cast(Check, import_module(name)) for name in names)


def diagnose(
    graph: ExpectedGraph,
    outcomes: Mapping[str, Answer | HostError],
    launched: Launched = MappingProxyType({}),
) -> Diagnosis:
    """Compares expected and observed; links symptoms to causes. A host without outcome was not probed.

    ``launched``: the nodes that launch files start, by host and program or robot.
    """
    found, context = Findings(graph.hosts), CheckContext(graph, outcomes, launched)
    for check in all_checks():
        check.compare(found, context)
    return found.diagnosis()
