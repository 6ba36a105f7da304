"""Launch files that lie on hosts only: which are to be read there, and what the rules find in them. Pure."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

from swarmctl.diagnostics import Diagnostic
from swarmctl.render.middleware import middleware_of
from swarmctl.ros_packages.package import Package
from swarmctl.rules.context import RuleContext
from swarmctl.rules.launch_uses import LaunchUse, declared_launches, evaluated
from swarmctl.rules.runner import lint
from swarmctl.spec.load import Document

Wanted = Mapping[str, frozenset[str]]  # paths by package
OnHosts = Mapping[str, Mapping[str, Package]]  # packages by host and name
_MAX_LAUNCHED = 50_000  # elements of the launch files of one host


@dataclass(frozen=True)
class HostLaunches:
    """The launch files that a spec names, by the host that starts them, each with its arguments."""

    document: Document
    by_host: Mapping[str, tuple[tuple[LaunchUse, Mapping[str, str | None]], ...]] = field(repr=False)

    def wanted(self, host: str, read: Mapping[str, Package]) -> Wanted:
        """The files to read on a host after those in ``read``; a package without paths is looked for."""
        found: dict[str, set[str]] = {}
        packages = replace(self.document.packages, on_hosts={host: read}).known_on(host)
        left = _MAX_LAUNCHED
        for use, arguments in self.by_host.get(host, ()):
            own, path = use.started.package or "", f"launch/{use.started.launch}"
            if own not in packages or packages[own].has(path) is None:
                found.setdefault(own, set()).add(path)
            elif left > 0 and (known := evaluated(use, arguments, packages, limit=left)) is not None:
                left -= known.launched.cost + 1
                for package, inner in known.launched.unread:
                    found.setdefault(package, set()).add(inner)
                for package in known.launched.packages:
                    if package not in packages:
                        found.setdefault(package, set())
        wanted: dict[str, frozenset[str]] = {}
        for name, paths in found.items():
            one = read.get(name)
            new = paths - (one.sought or frozenset()) if one is not None else paths
            is_away = one is not None and not one.folder
            if name not in self.document.packages.by_name and (one is None or new) and not is_away:
                wanted[name] = frozenset(new)
        return wanted

    def nodes(self, read: OnHosts) -> Mapping[tuple[str, str], frozenset[str]]:
        """The names of the nodes that launch files start for sure, by host and program or robot."""
        found: dict[tuple[str, str], frozenset[str]] = {}
        for host, launches in self.by_host.items():
            there = replace(self.document.packages, on_hosts={host: read.get(host, {})}).known_on(host)
            left = _MAX_LAUNCHED
            for use, arguments in launches:
                known = evaluated(use, arguments, there, limit=left) if left > 0 else None
                if known is not None:
                    left -= known.launched.cost + 1
                    names = (one.name for one in known.launched.nodes if one.name is not None and one.certain)
                    found[host, use.name] = frozenset(names)
        return found

    def findings(self, read: OnHosts) -> Mapping[str, tuple[Diagnostic, ...]]:
        """What the rules find with the files of the hosts and not without, by host.

        A finding belongs to the hosts whose files it names, or else to those that start what it is about.
        """
        if not any(read.values()):
            return {}
        known = set(lint(self.document))
        there = {host: {name: one for name, one in of.items() if one.folder} for host, of in read.items()}
        document = replace(self.document, packages=replace(self.document.packages, on_hosts=there))
        new = [one for one in lint(document) if one not in known]
        context = RuleContext(document)
        by_host: dict[str, list[Diagnostic]] = {}
        for one in new:
            for host in _hosts_of(one, context, there):
                by_host.setdefault(host, []).append(one)
        return {host: tuple(found) for host, found in by_host.items()}


def host_launches(document: Document) -> HostLaunches:
    """Returns the launch files that the programs and drivers of a document name."""
    by_host: dict[str, list[tuple[LaunchUse, Mapping[str, str | None]]]] = {}
    context = RuleContext(document)
    for use, arguments in declared_launches(context) if middleware_of(context.spec.ros.distro).ros1 else ():
        if use.host is not None:
            by_host.setdefault(use.host, []).append((use, arguments))
    return HostLaunches(document, {host: tuple(found) for host, found in by_host.items()})


def _hosts_of(found: Diagnostic, context: RuleContext, read: OnHosts) -> Iterable[str]:
    text = " ".join((found.message, *(note.text for note in found.notes)))
    named = [host for host in read if re.search(rf"(?<![\w.-]){re.escape(host)}:/", text)]
    if named:
        return named
    starting = {use.host for use in context.launches if use.owner in text}
    return [host for host in read if host in starting] or list(read)
