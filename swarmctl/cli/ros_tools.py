"""What a host lacks to run a tool of ROS."""

from __future__ import annotations

from swarmctl.remote.transport import HostError, Kind
from swarmctl.render.bundle import package
from swarmctl.render.middleware import Middleware
from swarmctl.render.topic_tool import NO_RELEASE, NO_TOOL


def lack(
    host: str,
    status: int | None,
    swarm: str,
    tool: str,
    ros_package: str,
    middleware: Middleware,
) -> HostError | None:
    """Returns the error that the exit ``status`` of ``in_release`` means; None for any other status."""
    if status == NO_RELEASE:
        message, hint = f"{host} has no release of `{swarm}`", "`swarmctl deploy SPEC` brings one"
        return HostError(Kind.FAILED, message, hint)
    if status == NO_TOOL:
        packages = " or ".join(f"`{one}`" for one in middleware.debian_packages(package(ros_package)))
        hint = f"install it there; the Debian package is {packages}"
        return HostError(Kind.FAILED, f"{host} has no `{tool}`", hint)
    return None
