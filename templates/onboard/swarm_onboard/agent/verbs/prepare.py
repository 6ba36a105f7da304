"""``prepare``: one step that makes the host fit: an account, packages, images, the build of a workspace."""

from __future__ import annotations

from swarm_onboard.agent import (
    accounts,
    debian,
    images,
    package_sources,
    platforms,
    python_packages,
    workspaces,
)
from swarm_onboard.agent.errors import RefusedError
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report


class Request(NamedTuple):
    """One step: add a ``source`` of packages, ``refresh`` the lists of packages, install by ``apt`` or
    ``pip``, ``pull`` images, named as ENGINE IMAGE, create ``account``, give it the ``keys`` of the account
    ``login``, a ``sudo`` rule or a ``group``, ``build`` workspaces.

    ``workspaces``: those of the host in their order; each is built upon those behind it."""

    swarm: str
    step: str
    targets: list[str]
    account: str
    login: str
    workspaces: list[str]


class Answer(NamedTuple):
    """``step``: the one that is done."""

    step: str


def handle(request: Request, payload: bytes, report: Report) -> Answer:  # noqa: PLR0912
    """Carries out one kind of step for all its targets. Raises ``RefusedError`` and ``FailedError``."""
    outside = home_of(request.swarm).outside
    account, step, targets = request.account, request.step, request.targets
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
        accounts.copy_keys(account, request.login, outside)
    elif step == "sudo":
        accounts.allow_sudo(account, outside)
    elif step == "group":
        for group in targets:
            accounts.join(account, group)
    elif step == "pull":
        images.pull_all(targets, report.note)
    elif step == "build":
        workspaces.build_in_order(targets, request.workspaces, outside, report.note)
    else:
        raise RefusedError(f"{step!r} is no step", "are swarmctl and its agent of one version?")
    return Answer(step)
