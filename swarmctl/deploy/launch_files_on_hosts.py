"""Reads the launch files that lie on hosts only, and lets the rules check them once all hosts were read."""

from __future__ import annotations

import threading
from collections.abc import Collection, Mapping
from dataclasses import replace

from swarm_agent.messages import LaunchFilesAnswer, LaunchFilesRequest
from swarm_agent.packages import WORKSPACE

from swarmctl.deploy import launch_texts
from swarmctl.diagnostics import Diagnostic
from swarmctl.plan.launch_findings import NOT_CHECKED, with_findings
from swarmctl.plan.plan import HostPlan
from swarmctl.remote.transport import Conversation
from swarmctl.render.bundle import Bundle
from swarmctl.ros_packages.host_package import on_host
from swarmctl.ros_packages.package import Package
from swarmctl.rules.host_launches import HostLaunches, host_launches
from swarmctl.spec.load import Document

_ROUNDS = 12  # includes within includes, whose names only a file that was read has
_LARGEST = 4 << 20  # bytes of the files of one host


class LaunchFiles:
    """The launch files of hosts: each read once while the hosts are observed, checked together afterwards."""

    def __init__(self, launches: HostLaunches) -> None:
        self._launches = launches
        self._read: dict[str, Mapping[str, Package]] = {}
        self._unchecked: set[str] = set()
        self._found: Mapping[str, tuple[Diagnostic, ...]] | None = None
        self._checking = threading.Lock()

    @property
    def hosts(self) -> frozenset[str]:
        """The hosts that start launch files which may lie there only."""
        return frozenset(host for host in self._launches.by_host if self._launches.wanted(host, {}))

    def read(self, conversation: Conversation, bundle: Bundle) -> None:
        """Reads the files of one host, with what they include. Raises ``HostError``."""
        host = bundle.host
        if host in self._read or host in self._unchecked:
            return
        packages: dict[str, Package] = {}
        for _ in range(_ROUNDS):
            wanted = self._launches.wanted(host, packages)
            if not wanted:
                with self._checking:
                    self._read[host], self._found = packages, None
                return
            answer = _with_texts(conversation, bundle, wanted)
            for name, paths in wanted.items():
                one = answer["packages"].get(name)
                if one is None:
                    break
                packages[name] = on_host(
                    host, name, one["folder"], sought=paths, has=one["has"], texts=one["texts"],
                    listed=one["launch"], before=packages.get(name),
                )  # fmt: skip
            size = sum(len(text) for one in packages.values() for text in one.contents.values())
            if not answer["complete"] or size > _LARGEST:
                break
        self._unchecked.add(host)

    def checked(self, plan: HostPlan) -> HostPlan:
        """Returns the plan of a host with what the rules find in its files. Call it once all were read."""
        if plan.host in self._unchecked:
            return replace(plan, notes=(*plan.notes, NOT_CHECKED))
        return with_findings(plan, self.findings().get(plan.host, ()))

    def findings(self) -> Mapping[str, tuple[Diagnostic, ...]]:
        """What the rules find in the files that were read, by host."""
        with self._checking:
            if self._found is None:
                self._found = self._launches.findings(self._read)
            return self._found

    def nodes(self) -> Mapping[tuple[str, str], frozenset[str]]:
        """The nodes that the files start, those of delivered packages too, by host and program or robot."""
        return self._launches.nodes(self._read)


def _with_texts(
    conversation: Conversation, bundle: Bundle, wanted: Mapping[str, Collection[str]]
) -> LaunchFilesAnswer:
    """What the host has of the ``wanted`` paths, by package. Only texts that are not kept yet are sent."""
    answer: LaunchFilesAnswer = conversation.ask(_request(bundle, wanted, texts=False))
    missing: dict[str, list[str]] = {}
    for name, one in answer["packages"].items():
        digests = {path: one["digests"][path] for path in wanted.get(name, ()) if path in one["digests"]}
        kept = {path: launch_texts.find(digest) for path, digest in digests.items()}
        one["texts"] = {path: text for path, text in kept.items() if text is not None}
        if due := [path for path, text in kept.items() if text is None]:
            missing[name] = due
    if not missing:
        return answer
    sent: LaunchFilesAnswer = conversation.ask(_request(bundle, missing, texts=True))
    for name, paths in missing.items():
        texts = sent["packages"][name]["texts"] if name in sent["packages"] else {}
        answer["packages"][name]["texts"] |= texts
        answer["complete"] &= sent["complete"] and texts.keys() >= set(paths)
        for text in texts.values():
            launch_texts.keep(text)
    return answer


def _request(bundle: Bundle, files: Mapping[str, Collection[str]], *, texts: bool) -> LaunchFilesRequest:
    return {
        "verb": "launch_files",
        "swarm": bundle.swarm,
        "requires": [one for one in bundle.asks if one.startswith(WORKSPACE)],
        "files": {name: sorted(paths) for name, paths in sorted(files.items())},
        "texts": texts,
    }


def launch_files_of(document: Document) -> LaunchFiles | None:
    """Returns what reads the launch files of a document's hosts; None if none lies on a host only."""
    found = LaunchFiles(host_launches(document))
    return found if found.hosts else None
