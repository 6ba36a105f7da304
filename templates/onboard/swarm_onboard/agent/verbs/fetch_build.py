"""``fetch_build``: a piece of what ``build_packages`` made of a package."""

from __future__ import annotations

import base64

from swarm_onboard.agent.package_builds import Workspace
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report

TYPE_CHECKING = False
if TYPE_CHECKING:
    from swarm_onboard.agent.preparation_messages import FetchBuildAnswer, FetchBuildRequest


def handle(request: FetchBuildRequest, payload: bytes, report: Report) -> FetchBuildAnswer:
    """Returns the piece in base64; empty at the end. Raises ``RefusedError``."""
    piece = Workspace(home_of(request["swarm"])).piece(request["package"], request["offset"])
    return {"data": base64.b64encode(piece).decode("ascii")}
