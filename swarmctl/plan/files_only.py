"""Whether a change is of files alone that nothing on the host uses by itself. Pure.

Such a change restarts and reloads nothing, and cannot lock the operator out: it needs no confirmation.
"""

from __future__ import annotations

from collections.abc import Sequence

from swarm_onboard.agent.steps import Kind, Step

from swarmctl.plan.observed_host import Observed
from swarmctl.render.bundle import Bundle

_OF_FILES = (Kind.CREATE, Kind.UPDATE, Kind.DELETE)
_AT_LOGIN = ("setup.bash",)  # people read it in the files of their shells, so that it may end a login


def files_only(steps: Sequence[Step], bundle: Bundle, observed: Observed) -> bool:
    """Returns True if the steps exchange nothing but files that no unit needs and no link or block shows."""
    old, new = observed.manifest, bundle.manifest
    if old is None or observed.digest in (None, bundle.digest) or observed.unfinished:
        return False
    if any(step.kind not in (*_OF_FILES, Kind.ACTIVATE) for step in steps):
        return False
    if any(old[part] != new[part] for part in ("units", "links", "blocks", "secrets")):
        return False
    if observed.links or observed.blocks:
        return False
    needed = {path for unit in new["units"] for path in unit["needs"]}
    used = {*needed, *new["links"].values(), *new["blocks"].values(), *_AT_LOGIN}
    return not any(step.kind in _OF_FILES and step.target in used for step in steps)
