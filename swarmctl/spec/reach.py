"""How to reach the hosts of a spec, and which robots each drives; read fast, from a spec with errors too.

No rule is checked and no robot type is read: `swarmctl stop` must not wait for that, nor fail for it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import yaml

from swarmctl.diagnostics import Diagnostic
from swarmctl.spec.selection_candidates import Candidates
from swarmctl.spec.selection_expansion import below, candidates_in, entries, selections
from swarmctl.spec.variable_scopes import replaced
from swarmctl.yamltext import ranges
from swarmctl.yamltext.files import LoadBudget
from swarmctl.yamltext.overlay import overlaid
from swarmctl.yamltext.project_files import ProjectFiles, tree_of

USER, PORT = "robot", 22  # where a spec has none


@dataclass(frozen=True)
class HostLogin:
    """What a spec has about logging in to a host. ``declared``: those of `user` and `port` that it sets.

    ``address``: where others reach it; ``via``: the host to jump through.
    """

    name: str
    address: str
    user: str = USER
    port: int = PORT
    via: str | None = None
    declared: frozenset[str] = field(default=frozenset(), compare=False)


@dataclass(frozen=True)
class Reach:
    """The name of a swarm, its hosts with an address, and what a selection can name."""

    name: str
    hosts: Mapping[str, HostLogin]
    candidates: Candidates


def reach_of(layers: Sequence[Path]) -> tuple[Reach | None, tuple[Diagnostic, ...]]:
    """Returns what the files of a spec say; None if they do not even name a swarm, with what is wrong."""
    budget = LoadBudget()
    found: list[Diagnostic] = []
    root: yaml.Node | None = None
    for path in layers:
        files = ProjectFiles.beside(path, budget)
        text = files.named(path)
        if isinstance(text, Diagnostic):
            found.append(text)
            continue
        tree, wrong = tree_of(text, path, files)
        found += wrong
        if tree is not None and ranges.may_stand_in(text):
            tree, _ = ranges.expand(tree, selections(tree))
        if tree is not None:
            root = tree if root is None else overlaid(root, tree)[0]
    root = replaced(root) if root is not None else None
    name = _text(below(root, "name"))
    if not name:
        return None, tuple(found)
    defaults = below(below(root, "defaults"), "host")
    sections = entries(below(root, "hosts"))
    logins = (_login(one, node, defaults, sections) for one, node in sections.items())
    hosts = {one.name: one for one in logins if one is not None}
    return Reach(name, hosts, candidates_in(root)), tuple(found)


def _login(
    name: str, host: yaml.Node, defaults: yaml.Node | None, others: Mapping[str, yaml.Node]
) -> HostLogin | None:
    address = _text(below(host, "address"))
    if address is None:
        return None
    via = _text(below(host, "via"))
    user, port = (_text(below(host, key)) or _text(below(defaults, key)) for key in ("user", "port"))
    given = {"user": user, "port": port if port is not None and port.isdecimal() else None}
    return HostLogin(
        name,
        address,
        given["user"] or USER,
        int(given["port"] or PORT),
        via if via is not None and _text(below(others.get(via), "address")) else None,
        frozenset(key for key, value in given.items() if value is not None),
    )


def _text(node: yaml.Node | None) -> str | None:
    return str(node.value) if isinstance(node, yaml.ScalarNode) and node.value else None
