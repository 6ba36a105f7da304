"""What people have edited on a host and a plan would replace. Pure."""

from __future__ import annotations

from dataclasses import replace

from swarm_onboard.agent.paths import ROOT

from swarmctl.adoption.changes import EditedFile
from swarmctl.plan.observed_host import Observed
from swarmctl.plan.plan import HostPlan, Problem
from swarmctl.render.bundle import Bundle
from swarmctl.render.rendered_values import same_meaning

EDITED = "edited"
_SHOWN = 3


def lost(bundle: Bundle, observed: Observed) -> str:
    """Returns which edits on the host the bundle would replace with other content, as text; empty if none."""
    paths = _paths(bundle, observed)
    if not paths:
        return ""
    more = f" and {len(paths) - _SHOWN} more" if len(paths) > _SHOWN else ""
    return f"{', '.join(paths[:_SHOWN])}{more} {'was' if len(paths) == 1 else 'were'} edited on the host"


def edited_files(bundle: Bundle, observed: Observed) -> list[EditedFile]:
    """Returns those edits as files of the release."""
    return [
        EditedFile(
            bundle.host,
            inside := bundle.blocks.get(path, path),
            path,
            observed.edit_texts.get(path),
            observed.files[inside]["sha256"] if inside in observed.files else "",
        )
        for path in _paths(bundle, observed)
    ]


def _paths(bundle: Bundle, observed: Observed) -> list[str]:
    """The edited files and blocks that the bundle would replace with what means something else."""
    wanted = {file.path: file for file in bundle.files}
    wanted |= {path: wanted[inside] for path, inside in bundle.blocks.items()}

    def is_lost(path: str, digest: str) -> bool:
        file, text = wanted.get(path), observed.edit_texts.get(path)
        if file is None or text is None or file.digest == digest:
            return file is None or file.digest != digest
        return not same_meaning(path, text, file.content.decode("utf-8", "replace"))

    return [path for path, digest in observed.edits.items() if is_lost(path, digest)]


def not_edited(plan: HostPlan, bundle: Bundle, observed: Observed) -> HostPlan:
    """Returns the plan, with a problem if it would replace an edit with other content."""
    text = lost(bundle, observed) if plan.steps else ""
    return replace(plan, problem=Problem(EDITED, text, hint(bundle.swarm))) if text else plan


def hint(swarm: str) -> str:
    """Returns what to do about an edit on a host."""
    return (
        "`swarmctl adopt` shows it as a change of the spec, and `deploy --adopt` makes that first; "
        f"`deploy --overwrite-edits` replaces it, with a copy in {ROOT}/{swarm}/state/edits"
    )
