"""What has a fixed name in a release is refused as the name of a robot or a program."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.render.build_bundle import bundles
from swarmctl.swarm import names
from tests import ROOT
from tests.loading import load_swarm

EXAMPLES = sorted((ROOT / "examples").glob("paper-*/swarm.yaml"))


@pytest.mark.parametrize("spec", EXAMPLES, ids=lambda path: path.parent.name)
def test_every_tool_of_a_release_is_a_taken_name(spec: Path) -> None:
    swarm, found = load_swarm(spec)
    assert swarm is not None, found
    tools = {
        file.path.removeprefix("bin/")
        for bundle in bundles(swarm).values()
        for file in bundle.files
        if file.path.startswith("bin/")
    }
    assert tools - set(swarm.programs) <= set(names.TOOLS)
