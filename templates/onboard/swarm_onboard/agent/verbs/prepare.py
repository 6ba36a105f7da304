"""``prepare``: one step that makes the host fit: an account, packages, images, the build of a workspace."""

from __future__ import annotations

from swarm_onboard.agent import (
    accounts,
    debian,
    image_pulls,
    package_sources,
    platforms,
    python_packages,
    workspaces,
)
from swarm_onboard.agent.errors import RefusedError
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report

TYPE_CHECKING = False
if TYPE_CHECKING:
    from swarm_onboard.agent.preparation_messages import PrepareAnswer, PrepareRequest


def handle(request: PrepareRequest, payload: bytes, report: Report) -> PrepareAnswer:  # noqa: PLR0912
    """Carries out one kind of step for all its targets. Raises ``RefusedError`` and ``FailedError``."""
    outside = home_of(request["swarm"]).outside
    account, step, targets = request["account"], request["step"], request["targets"]
    report.detach()  # half an installation is worse than one that nobody waits for
    if step == "source":
        for server in targets:
            package_sources.add(server, platforms.platform(outside), outside)
    elif step == "refresh":
        debian.refresh(report.note)
    elif step == "apt":
        debian.install(targets, report.note)
    elif step == "pip":
        python_packages.install(targets, report.note)
    elif step == "account":
        accounts.create(account)
    elif step == "keys":
        accounts.copy_keys(account, request["login"], outside)
    elif step == "sudo":
        accounts.allow_sudo(account, outside)
    elif step == "group":
        for group in targets:
            accounts.join(account, group)
    elif step == "pull":
        image_pulls.pull_all(targets, report.note)
    elif step == "build":
        workspaces.build_in_order(targets, request["workspaces"], outside, report.note)
    else:
        raise RefusedError(f"{step!r} is no step", "are swarmctl and its agent of one version?")
    return {"step": step}
