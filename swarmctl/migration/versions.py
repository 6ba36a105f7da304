"""The versions of the spec format that this swarmctl reads, and the finding about a spec of another one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import yaml

from swarmctl.diagnostics import Diagnostic
from swarmctl.migration.steps import Step
from swarmctl.yamltext.compose import PLAIN, pairs_of, span_of
from swarmctl.yamltext.scalars import number_or_text

KEY = "version"
CODE = "SPEC006"


@dataclass(frozen=True)
class Versions:
    """The current version, and for each older one the steps that lead to the version after it."""

    current: int
    steps_from: Mapping[int, tuple[Step, ...]] = field(default_factory=dict)


SPEC_VERSIONS = Versions(1)


def declared(root: yaml.Node | None) -> int | None:
    """Returns the version that a spec declares; None without a whole number."""
    node = _node(root)
    if not isinstance(node, yaml.ScalarNode) or node.tag != PLAIN or not node.value:
        return None
    value = number_or_text(node.value)
    return int(value) if isinstance(value, (int, float)) and value == value // 1 else None


def version_finding(root: yaml.Node | None, path: str, versions: Versions) -> Diagnostic | None:
    """Returns the error about a spec of an older version, or of one that this swarmctl does not know."""
    version, node = declared(root), _node(root)
    if version is None or node is None or version == versions.current:
        return None
    if version > versions.current:
        message = f"version {version} of the spec format is newer than this swarmctl"
        help_ = (
            f"install a newer swarmctl: this one knows version {versions.current} (`swarmctl --version`)",
            f"write `version: {versions.current}` if the spec is of that version",
        )
        return Diagnostic(CODE, message, span_of(node), help=help_)
    if version in versions.steps_from:
        message = f"this spec has version {version} of the format; the current one is {versions.current}"
        way = f"`swarmctl migrate {path}` shows the new text, and with `--write` writes it"
        return Diagnostic(CODE, message, span_of(node), help=(way,))
    return None


def _node(root: yaml.Node | None) -> yaml.Node | None:
    pairs = pairs_of(root) if isinstance(root, yaml.MappingNode) else {}
    return pairs[KEY][1] if KEY in pairs else None
