"""The version of the spec format that this swarmctl reads, and the finding about a spec of another one."""

from __future__ import annotations

import yaml

from swarmctl.diagnostics import Diagnostic
from swarmctl.yamltext.compose import PLAIN, pairs_of, span_of
from swarmctl.yamltext.scalars import number_or_text

CODE = "SPEC006"
CURRENT = 1


def version_finding(root: yaml.Node | None) -> Diagnostic | None:
    """Returns the error about a spec of a newer version than this swarmctl knows."""
    pairs = pairs_of(root) if isinstance(root, yaml.MappingNode) else {}
    _, node = pairs.get("version", (None, None))
    if not isinstance(node, yaml.ScalarNode) or node.tag != PLAIN or not node.value:
        return None
    version = number_or_text(node.value)
    if not isinstance(version, (int, float)) or version != version // 1 or version <= CURRENT:
        return None
    return Diagnostic(
        CODE,
        f"version {int(version)} of the spec format is newer than this swarmctl",
        span_of(node),
        help=(
            f"install a newer swarmctl: this one knows version {CURRENT} (`swarmctl --version`)",
            f"write `version: {CURRENT}` if the spec is of that version",
        ),
    )
