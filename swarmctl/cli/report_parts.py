"""What a report has of a swarm; each host that does not answer costs its own part alone."""

from __future__ import annotations

import dataclasses
import json
import os
import platform
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any, TypeVar

from swarmctl.cli import console, deploy_steps, left_hosts, swarm_look
from swarmctl.cli.swarm_look import Expected
from swarmctl.version import __version__

if TYPE_CHECKING:
    from swarmctl.health.swarm_health import Look
    from swarmctl.remote.parallel_hosts import Event
    from swarmctl.remote.transport import Target, Transport
    from swarmctl.render.bundle import Bundle

_LINES = 1000  # of the log of each host
_MOST_LOGS = 32 << 20  # characters of all logs
_LIBRARIES = ("networkx", "paramiko", "pydantic", "rich", "typer")

_Result = TypeVar("_Result")


@dataclass
class Parts:
    """Reads the parts of a swarm's report; ``missing`` has by host why a part of it is not there."""

    expected: Expected
    targets: Mapping[str, Target]
    transport: Transport
    parallel: int
    in_lab: bool
    missing: dict[str, str] = field(default_factory=dict)

    def look(self, window: float) -> Look:
        """The health of the swarm."""
        look = swarm_look.looking_at(
            self.expected, self.targets, self.transport, window=window, parallel=self.parallel
        )()
        away = {host.name for host in look.status.hosts if not host.reachable}
        for one in look.status.diagnosis.troubles:
            if one.host in away:
                self.missing.setdefault(one.host, one.message)
        for name in away:  # optional ones make no trouble
            self.missing.setdefault(name, "it was not reached")
        return look

    def plan(self, wanted: Mapping[str, Bundle], secrets: Mapping[str, str]) -> Any:
        """What ``plan --json`` prints."""
        from swarmctl.deploy.rollout import observe

        swarm = self.expected.swarm
        lists = left_hosts.lists_of(swarm)
        made = observe(
            wanted, self.targets, self.transport, parallel=self.parallel, secrets=secrets, host_lists=lists
        )
        left = left_hosts.left_hosts(swarm, lists, in_lab=self.in_lab)
        made = deploy_steps.with_single_points(made, self.expected.document)
        return made.to_json() | {"left_hosts": sorted((*left[0], *left[1]))}

    def edits(self, wanted: Mapping[str, Bundle]) -> dict[str, str]:
        """The files of ``wanted`` that were edited on hosts, as they are there."""
        from swarmctl.deploy.observe_host import edits_on_hosts
        from swarmctl.remote.transport import HostError

        texts: dict[str, str] = {}
        found = edits_on_hosts(wanted, self.targets, self.transport, parallel=self.parallel)
        for host, answer in found.items():
            if isinstance(answer, HostError):
                self.missing.setdefault(host, answer.message)
                continue
            ours = {file.path for file in wanted[host].files}  # a host may name any path
            for one in answer:
                if one.text is not None and one.path in ours:
                    texts[f"edits/{host}/{one.place.lstrip('/')}"] = one.text
        return texts

    def logs(self, since: float) -> list[dict[str, Any]]:
        """The last entries of all hosts, in the order of time, as ``logs --json`` prints them."""
        from swarmctl.health.host_logs import Merge, Question, host_logs

        question = Question(self.expected.swarm.name, dict.fromkeys(self.targets, ()), _LINES, since)
        merge = Merge()
        events = host_logs(question, list(self.targets.values()), self.transport, parallel=self.parallel)
        for log in self._answered(events).values():
            for entry in log.entries:
                merge.add(entry, 0.0)
        return [dataclasses.asdict(entry) for entry in merge.rest()]

    def runs(self) -> list[dict[str, Any]]:
        """The runs that changed the hosts, as in ``history --json``."""
        from swarmctl.deploy.host_records import histories
        from swarmctl.plan.history import runs

        name, targets = self.expected.swarm.name, list(self.targets.values())
        found = self._answered(histories(name, targets, self.transport, parallel=self.parallel))
        logs = {host: one.entries for host, one in found.items()}
        return [run.to_json() for run in runs(logs)]

    def _answered(self, events: Iterable[Event[_Result]]) -> dict[str, _Result]:
        from swarmctl.remote.parallel_hosts import Finished
        from swarmctl.remote.transport import HostError

        found: dict[str, _Result] = {}
        for event in events:
            if isinstance(event, Finished):
                result = event.outcome
                if isinstance(result, HostError):
                    self.missing.setdefault(event.host, result.message)
                else:
                    found[event.host] = result
        return found

    def versions(self) -> dict[str, Any]:
        """Those of swarmctl and of what it runs on."""
        return {
            "swarmctl": __version__,
            "python": platform.python_version(),
            "system": platform.platform(),
            "ros": ", ".join(self.expected.swarm.distros),
            "libraries": {name: metadata.version(name) for name in _LIBRARIES},
        }

    def motion(self) -> dict[str, Any]:
        """What shows bags of the swarm later: the topics on how robots move, and their start poses."""
        from swarmctl.swarm.topic_island import motion_topics
        from swarmctl.ui.messages import starts

        topics = motion_topics(self.expected.swarm)
        return {
            "topics": {name: dataclasses.asdict(one) for name, one in topics.items()},
            "starts": starts(self.expected.document.spec),
        }

    def drawn(self, clean: Callable[[Any], Any]) -> dict[str, str]:
        """The graph as text of JSON and as SVG."""
        from swarmctl.analysis.diagram import diagram
        from swarmctl.views.graph import svg

        drawing = diagram(self.expected.index)
        document = {"v": 1, **drawing.to_json()}
        return {"graph.json": written(clean(document)), "graph.svg": clean(svg.graph(drawing))}

    def spec(self, folder: Path, overlays: list[str]) -> dict[str, str]:
        """The files that the spec reads, and the effective spec."""
        from swarmctl.spec.effective_spec import flat
        from swarmctl.views import effective_spec

        document = self.expected.document
        texts = {_inside(file, folder): text for file, text in document.texts.items()}
        return {**texts, "effective.yaml": effective_spec.yaml_of(flat(document, overlays))}


def _inside(file: str, folder: Path) -> str:
    """The name in the archive of a file of the spec; folders above that of the spec are called ``up``."""
    words = PurePath(os.path.relpath(file, folder)).parts
    return "/".join(("spec", *("up" if word == ".." else word for word in words)))


def written(document: Any) -> str:
    """A JSON document as ``--json`` prints it."""
    return json.dumps(document, indent=2) + "\n"


def lines_of(entries: list[dict[str, Any]]) -> str:
    """The newest entries as lines of JSON, as many as an archive takes."""
    kept: list[str] = []
    left = _MOST_LOGS
    for entry in reversed(entries):
        line = json.dumps(entry) + "\n"
        left -= len(line)
        if left < 0:
            break
        kept.append(line)
    return "".join(reversed(kept))


def say(what: str) -> None:
    """Prints on stderr what is read now."""
    console.show(f"reading {what} ...", error=True)
