"""The security of the labs of experiments and of recovery: ``SWARM_SECURITY=sealed make experiments``."""

from __future__ import annotations

import os
from pathlib import Path

from tests.e2e.lab_swarm import LabSwarm

LEVEL = os.environ.get("SWARM_SECURITY", "")
GUARDED = ("filtered", "sealed")


def secured(text: str) -> str:
    """Returns a spec with that level; without one, as it is."""
    return f"{text}security: {LEVEL}\n" if LEVEL else text


def secured_spec(spec: Path, folder: Path) -> Path:
    """The same for a file: a copy in ``folder``."""
    copy = folder / "secured.yaml"
    copy.write_text(secured(spec.read_text("utf-8")), "utf-8")
    return copy


def pinned(swarm: LabSwarm, spec: Path | None = None) -> None:
    """In a sealed swarm `trust` precedes the first deploy."""
    if LEVEL == "sealed":
        run = swarm.swarmctl("trust", spec=spec)
        assert run.status == 0, run.out + run.err
