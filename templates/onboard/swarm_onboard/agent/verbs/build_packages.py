"""``build_packages``: compile the operator's ROS packages on this host."""

from __future__ import annotations

import pwd

from swarm_onboard.agent import catkin, disk
from swarm_onboard.agent.errors import RefusedError
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.package_builds import Workspace
from swarm_onboard.agent.platforms import platform
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report


class Request(NamedTuple):
    """Build the packages in the payload, a tar.gz of ``PACKAGE/path``, upon the ``workspaces`` of the host.

    ``packages``: those whose results are wanted; ``folders``: by package what errors call its folder.
    """

    swarm: str
    account: str
    workspaces: list[str]
    packages: list[str]
    folders: dict[str, str]


class Answer(NamedTuple):
    """``sizes``: by package, bytes of its results, a tar.gz; ``platform``: what they are compiled for."""

    platform: str
    sizes: dict[str, int]


def handle(request: Request, payload: bytes, report: Report) -> Answer:
    """Builds the packages in the payload. Raises ``RefusedError`` and ``FailedError``."""
    home = home_of(request.swarm)
    try:
        owner = pwd.getpwnam(request.account)
    except KeyError as error:
        raise RefusedError(f"there is no account {request.account}", "run `swarmctl prepare`") from error
    workspace = Workspace(home)
    with disk.named_if_full(home.path, "the build"), workspace.held(owner):
        names = workspace.write_sources(payload)
        setups = catkin.setup_files(request.workspaces, home.outside)
        workspace.build(owner, setups, request.folders, report.note)
        sizes = {name: workspace.pack(name) for name in request.packages if name in names}
    return Answer(platform(home.outside), sizes)
