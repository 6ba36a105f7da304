"""The loader of the agent works in any login shell."""

from __future__ import annotations

import json

from tests import ROOT


def test_the_loader_means_the_same_to_every_login_shell() -> None:
    lines = (ROOT / "templates/packages/agent/loader.py").read_text().splitlines(keepends=True)
    source = "".join(line for line in lines if not line.startswith("#"))
    assert not set("'\\!") & set(source)
    assert json.dumps(source).isascii()
