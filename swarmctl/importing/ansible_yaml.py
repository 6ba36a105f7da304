"""Reads an inventory in Ansible's YAML format, and files of variables, as trees with lines."""

from __future__ import annotations

from collections.abc import Iterator

import yaml

from swarmctl.importing.draft import Unread
from swarmctl.importing.inventory import COMPUTED, Inventory, Variable, Variables, expanded, without_port
from swarmctl.ros_packages.launched import Place
from swarmctl.yamltext.compose import compose
from swarmctl.yamltext.limits import LoadBudget

_PARTS = {"hosts", "children", "vars"}
_VAULT_FILE = "$ANSIBLE_VAULT;"


def is_yaml_inventory(root: yaml.Node | None) -> bool:
    """Returns True if all keys at the top of a YAML file are groups, one with hosts or children."""
    if not isinstance(root, yaml.MappingNode):
        return False
    groups = [{part for part, _, _ in pairs(value)} for _, value, _ in pairs(root)]
    return any({"hosts", "children"} & one for one in groups) and all(one <= _PARTS for one in groups)


def tree_of(path: str, text: str) -> yaml.Node | Unread | None:
    """Returns the nodes of a YAML file; why it cannot be read; None for an empty one."""
    if text.startswith(_VAULT_FILE):
        return Unread(Place(path, 0), "the whole file is encrypted by ansible-vault")
    root, problem = compose(text, path, LoadBudget())
    if problem is not None:
        line = problem.span.line if problem.span else 0
        return Unread(Place(path, line), "it is not valid YAML")  # the message might show a secret
    return root


def yaml_inventory(path: str, text: str) -> Inventory:
    """Returns the inventory of a file."""
    found = Inventory()
    root = tree_of(path, text)
    if isinstance(root, Unread):
        found.unread.append(root)
    elif isinstance(root, yaml.MappingNode):
        seen: set[tuple[str, int]] = set()
        for name, group, _ in pairs(root):
            _group(found, path, name, group, seen)
    return found


def variables_of(path: str, text: str) -> tuple[Variables, tuple[Unread, ...]]:
    """Returns the variables of a file in group_vars or host_vars."""
    root = tree_of(path, text)
    if isinstance(root, Unread):
        return {}, (root,)
    return _variables(path, root), ()


def _group(found: Inventory, path: str, name: str, node: yaml.Node, seen: set[tuple[str, int]]) -> None:
    """Adds a group. One that an alias repeats is read once, so that aliases of aliases cost no time."""
    group = found.group(name)
    if (name, id(node)) in seen:
        return
    seen.add((name, id(node)))
    for part, value, line in pairs(node):
        if part == "vars":
            group.variables.update(_variables(path, value))
        elif part == "children":
            for child, inner, _ in pairs(value):
                group.children[child] = None
                _group(found, path, child, inner, seen)
        elif part == "hosts":
            for pattern, inner, host_line in pairs(value):
                _host(found, name, pattern, _variables(path, inner), Place(path, host_line))
        else:
            found.unread.append(Unread(Place(path, line), "it is no part of a group"))


def _host(found: Inventory, group: str, pattern: str, variables: Variables, place: Place) -> None:
    pattern, port = without_port(pattern)
    names = "the inventory has too many hosts" if found.is_full else expanded(pattern)
    if COMPUTED.search(pattern):
        names = "a template computes the host's name"
    if port:
        variables.setdefault("ansible_port", Variable(port, place))
    why = names if isinstance(names, str) else found.add_hosts(names, group, variables, place)
    if why:
        found.unread.append(Unread(place, why))


def _variables(path: str, node: yaml.Node | None) -> Variables:
    return {key: _variable(Place(path, line), value) for key, value, line in pairs(node)}


def _variable(place: Place, node: yaml.Node) -> Variable:
    if isinstance(node, yaml.ScalarNode):
        return Variable(str(node.value), place, is_vault="vault" in node.tag)
    return Variable("", place, is_nested=True)


def pairs(node: yaml.Node | None) -> Iterator[tuple[str, yaml.Node, int]]:
    """The keys and values of a mapping, and the lines of its keys; nothing for anything else."""
    for key, value in node.value if isinstance(node, yaml.MappingNode) else ():
        if isinstance(key, yaml.ScalarNode):
            yield str(key.value), value, key.start_mark.line + 1
