"""Hosts in a folder, as checks of hosts look at them."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path

import pytest
from swarm_onboard.agent.release_store import Home


def program(folder: Path, monkeypatch: pytest.MonkeyPatch, name: str, script: str) -> None:
    """Puts a shell script in the place of a program of the host."""
    path = folder / "usr/bin" / name
    path.parent.mkdir(parents=True)
    path.write_text(f"#!/bin/sh\n{script}\n")
    path.chmod(0o755)
    monkeypatch.setenv("PATH", str(path.parent), prepend=os.pathsep)


def with_unit(folder: Path, unit: str, content: bytes, links: Mapping[str, str] | None = None) -> Home:
    """A host whose release has one unit."""
    entry = {"sha256": sha256(content).hexdigest(), "mode": 0o644, "size": len(content)}
    manifest = json.dumps(
        {
            "format": 1,
            "files": {f"units/{unit}": entry},
            "units": [{"name": unit, "inputs": []}],
            "links": links or {},
            "blocks": {},
        }
    )
    home = Home("new", str(folder))
    release = Path(home.release(sha256(manifest.encode()).hexdigest()[:16]))
    (release / "units").mkdir(parents=True)
    (release / "units" / unit).write_bytes(content)
    (release / "manifest.json").write_text(manifest)
    Path(home.current_link).symlink_to(f"releases/{release.name}")
    return home
