"""The loader of the agent works in any login shell."""

from __future__ import annotations

import json

from swarm_onboard.agent.paths import AGENT_FOLDER

from swarmctl.resources import onboard

LOADER = onboard() / "agent/loader.py"


def test_the_loader_means_the_same_to_every_login_shell() -> None:
    lines = LOADER.read_text().splitlines(keepends=True)
    source = "".join(line for line in lines if not line.startswith("#"))
    assert not set("'\\!") & set(source)
    assert json.dumps(source).isascii()


def test_the_loader_keeps_the_agent_in_its_folder() -> None:
    """The loader runs before the agent's modules are there, so that it cannot import the path."""
    assert f'"{AGENT_FOLDER}"' in LOADER.read_text()
