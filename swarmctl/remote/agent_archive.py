"""The agent as the archive that a host keeps: its verbs, a middleware's module, and what these import."""

from __future__ import annotations

from dataclasses import dataclass, field
from hashlib import sha256

from swarmctl.onboard_archive import archive_of
from swarmctl.resources import HostModule, host_check_names

DEPLOY_VERBS = (
    "observe",
    "lease",
    "host_list",
    "apply",
    "hold",
    "confirm",
    "undo",
    "remove",
    "stop",
    "start",
    "restart",
    "motion",
    "trial",
)
ROLLBACK_VERBS = ("observe", "history", "motion", "lease", "rollback", "hold", "confirm", "undo")
#: What the host runs later, out of the archive of a verb.
_PROGRAMS = {**dict.fromkeys(("apply", "remove", "rollback", "trial"), "recovery"), "record": "recorder"}


@dataclass(frozen=True)
class Agent:
    """The agent with some of its verbs, as the archive that a host keeps."""

    archive: bytes = field(repr=False)
    digest: str


def agent(verbs: tuple[str, ...] = DEPLOY_VERBS, module: HostModule | None = None) -> Agent:
    """The agent with ``verbs``, and with a ``module`` that one of them runs. Same sources, same bytes.

    Raises ModuleNotFoundError if there is no such module.
    """
    names = ["main", "compiled", *(f"verbs.{verb}" for verb in verbs)]
    names += [program for verb, program in _PROGRAMS.items() if verb in verbs]
    names = [f"swarm_onboard.agent.{name}" for name in names]
    if "probe" in verbs:
        names += [f"swarm_onboard.host_checks.{name}" for name in host_check_names()]
    content = archive_of(tuple(names), module)
    return Agent(content, sha256(content).hexdigest())
