"""``fetch_build``: a piece of what ``build_packages`` made of a package."""

from __future__ import annotations

import base64

from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.package_builds import Workspace
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report


class Request(NamedTuple):
    """A piece of the results of a ``package``, from the byte ``offset`` on."""

    swarm: str
    package: str
    offset: int


class Answer(NamedTuple):
    """``data``: the piece in base64."""

    data: str


def handle(request: Request, payload: bytes, report: Report) -> Answer:
    """Returns the piece in base64; empty at the end. Raises ``RefusedError``."""
    piece = Workspace(home_of(request.swarm)).piece(request.package, request.offset)
    return Answer(base64.b64encode(piece).decode("ascii"))
