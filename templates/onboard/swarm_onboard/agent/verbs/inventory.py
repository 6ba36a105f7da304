"""``inventory``: what a host has of the things that ``prepare`` installs, without changing anything."""

from __future__ import annotations

from swarm_onboard.agent import (
    accounts,
    debian,
    images,
    package_sources,
    preflight,
    python_packages,
    rosdep,
    workspaces,
)
from swarm_onboard.agent.accounts import AccountState
from swarm_onboard.agent.images import Image
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report
from swarm_onboard.agent.verbs.observe import Facts, facts

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Literal, Sequence


class Request(NamedTuple):
    """What the host has of what it may need. ``requires`` as for ``observe``; ``debian``: names
    of Debian packages, ``pip``: names with an optional ``==version``; ``groups``: which of these exist;
    ``rosdep``: keys of package.xml files, to be looked up for the ROS ``distro``; ``images``: each with its
    engine."""

    swarm: str
    requires: Sequence[str]
    debian: Sequence[str]
    pip: Sequence[str]
    account: str
    groups: Sequence[str]
    workspaces: Sequence[str]
    rosdep: Sequence[str]
    distro: str
    images: Sequence[tuple[str, str]]


class Answer(NamedTuple):
    """``debian``: state by package; ``pip``: version or null by requirement; ``workspaces``: by path;
    ``rosdep``: Debian packages by key, as far as the host's rosdep knows them; ``sources``: servers of
    apt; ``images``: in the order of the request; ``wireless``: interfaces with a radio."""

    facts: Facts
    debian: dict[str, Literal["installed", "available", "unknown"]]
    pip: dict[str, str | None]
    account: AccountState
    groups: list[str]
    workspaces: dict[str, Literal["built", "sources", "absent"]]
    rosdep: dict[str, list[str]]
    sources: list[str]
    images: list[Image]
    wireless: list[str]


def handle(request: Request, payload: bytes, report: Report) -> Answer:
    """Returns the host's facts, the states of its packages, its account and its workspaces."""
    home = home_of(request.swarm)
    own = facts(home, request.requires)
    absent = [key for key in request.rosdep if not own.has.get(f"package:{key}")]
    resolved = rosdep.resolved(absent, request.distro, request.account)
    named = [name for names in resolved.values() for name in names]
    return Answer(
        facts=own,
        sources=package_sources.servers(home.outside),
        debian=debian.states([*request.debian, *named]),
        rosdep=resolved,
        pip=python_packages.versions(request.pip, home.outside),
        account=accounts.state(request.account, home.outside),
        groups=accounts.existing(request.groups),
        images=[images.look(*one) for one in request.images],
        wireless=preflight.wireless(home.outside),
        workspaces={path: workspaces.state(path, home.outside) for path in request.workspaces},
    )
