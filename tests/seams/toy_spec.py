"""Specs that name the toys."""

from __future__ import annotations

from pathlib import Path

from swarmctl.swarm.resolved import Swarm
from tests import ROOT
from tests.loading import load_swarm

SPEC = ROOT / "tests/mode_conversion/modes/standalone.yaml"
TOPICS = "topics: [{topic: /k3/odom, to: [koala-laptop]}]"
HUB, SILENT = "koala-laptop", "k3-pi"


def written(
    tmp_path: Path,
    distro: str = "pebble",
    provider: str = "mesh",
    more: str = "",
    *,
    name: str = "newswarm",
    programs: str = "",
) -> Path:
    """A spec of three islands.

    ``more``: keys of ``multimaster``, each with a comma behind it. Without a ``provider`` there is none.
    """
    spec = tmp_path / "swarm.yaml"
    text = SPEC.read_text("utf-8").replace("name: newswarm", f"name: {name}")
    text += f"ros: {{distro: {distro}}}\n"
    if provider:
        text += f"multimaster: {{provider: {provider}, {more}{TOPICS}}}\n"
    spec.write_text(f"{text}programs: {{{programs}}}\n" if programs else text, "utf-8")
    return spec


def swarm_of(spec: Path) -> Swarm:
    swarm, found = load_swarm(spec)
    assert swarm is not None, found
    return swarm
