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
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report
from swarm_onboard.agent.verbs.observe import facts

TYPE_CHECKING = False
if TYPE_CHECKING:
    from swarm_onboard.agent.preparation_messages import InventoryAnswer, InventoryRequest


def handle(request: InventoryRequest, payload: bytes, report: Report) -> InventoryAnswer:
    """Returns the host's facts, the states of its packages, its account and its workspaces."""
    home = home_of(request["swarm"])
    own = facts(home, request["requires"])
    absent = [key for key in request["rosdep"] if not own["has"].get(f"package:{key}")]
    resolved = rosdep.resolved(absent, request["distro"], request["account"])
    named = [name for names in resolved.values() for name in names]
    return {
        "facts": own,
        "sources": package_sources.servers(home.outside),
        "debian": debian.states([*request["debian"], *named]),
        "rosdep": resolved,
        "pip": python_packages.versions(request["pip"], home.outside),
        "account": accounts.state(request["account"], home.outside),
        "groups": accounts.existing(request["groups"]),
        "images": [images.look(one) for one in request["images"]],
        "wireless": preflight.wireless(home.outside),
        "workspaces": {path: workspaces.state(path, home.outside) for path in request["workspaces"]},
    }
