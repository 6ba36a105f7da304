"""What people have edited on a host and a plan would replace. Pure."""

from __future__ import annotations

from dataclasses import replace

from swarm_agent.paths import ROOT

from swarmctl.plan.observed_host import Observed
from swarmctl.plan.plan import HostPlan, Problem
from swarmctl.render.bundle import Bundle

EDITED = "edited"
_SHOWN = 3


def lost(bundle: Bundle, observed: Observed) -> str:
    """Returns which edits on the host the bundle would replace with other content, as text; empty if none."""
    wanted = {file.path: file.digest for file in bundle.files}
    wanted |= {path: wanted[inside] for path, inside in bundle.blocks.items()}
    paths = [path for path, digest in observed.edits.items() if wanted.get(path) != digest]
    if not paths:
        return ""
    more = f" and {len(paths) - _SHOWN} more" if len(paths) > _SHOWN else ""
    return f"{', '.join(paths[:_SHOWN])}{more} {'was' if len(paths) == 1 else 'were'} edited on the host"


def not_edited(plan: HostPlan, bundle: Bundle, observed: Observed) -> HostPlan:
    """Returns the plan, with a problem if it would replace an edit with other content."""
    text = lost(bundle, observed) if plan.steps else ""
    return replace(plan, problem=Problem(EDITED, text, hint(bundle.swarm))) if text else plan


def hint(swarm: str) -> str:
    """Returns what to do about an edit on a host."""
    return (
        "`swarmctl plan --diff` shows it: write into the spec what shall stay; "
        f"`deploy --overwrite-edits` replaces it, with a copy in {ROOT}/{swarm}/state/edits"
    )
