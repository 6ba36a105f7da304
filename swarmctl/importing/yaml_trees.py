"""YAML files of a lab as trees of nodes with lines."""

from __future__ import annotations

from collections.abc import Iterator

import yaml

from swarmctl.importing.draft import Unread
from swarmctl.ros_packages.launched import Place
from swarmctl.yamltext.compose import compose
from swarmctl.yamltext.limits import LoadBudget

VAULT_FILE = "$ANSIBLE_VAULT;"  # how a file begins that ansible-vault encrypts


def tree_of(path: str, text: str) -> yaml.Node | Unread | None:
    """Returns the nodes of a YAML file; why it cannot be read; None for an empty one."""
    if text.startswith(VAULT_FILE):
        return Unread(Place(path, 0), "the whole file is encrypted by ansible-vault")
    root, problem = compose(text, path, LoadBudget())
    if problem is not None:
        line = problem.span.line if problem.span else 0
        return Unread(Place(path, line), "it is not valid YAML")  # the message might show a secret
    return root


def pairs(node: yaml.Node | None) -> Iterator[tuple[str, yaml.Node, int]]:
    """The keys and values of a mapping, and the lines of its keys; nothing for anything else."""
    for key, value in node.value if isinstance(node, yaml.MappingNode) else ():
        if isinstance(key, yaml.ScalarNode):
            yield str(key.value), value, key.start_mark.line + 1
