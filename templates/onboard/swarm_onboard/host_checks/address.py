"""The address under which other hosts reach the nodes of a host: it must be one of its own."""

from __future__ import annotations

import socket

from swarm_onboard.agent import command, files, process_environment
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.host_checks import Judged

TYPE_CHECKING = False
if TYPE_CHECKING:
    from swarm_onboard.agent.release_store import Home

TABLE = (("its nodes advertise an address that the host does not have", "a warning, with those it has"),)
#: The first that is set counts (wiki.ros.org/ROS/EnvironmentVariables); the last is of a release of ROS 2.
_NAMES = ("ROS_HOSTNAME", "ROS_IP", "SWARM_ADDRESS")


class Seen(NamedTuple):
    """What nodes advertise, whether it is an address of the host, and those that it has if not."""

    advertised: str
    own: bool
    addresses: list[str]


def observe(home: Home) -> list[Seen]:
    """Binds a socket to what the release has nodes advertise; nothing without a release or a middleware."""
    name = advertised(home)
    if not name:
        return []
    if _is_own(name):
        return [Seen(name, True, [])]
    return [Seen(name, False, command.output_of(["hostname", "-I"]).split())]


def advertised(home: Home) -> str:
    """Returns the address or name that the release has nodes advertise; empty text if none."""
    content = files.read(f"{home.current_link}/{process_environment.ROS}") or b""
    variables = process_environment.variables_in(content.decode("utf-8", "replace"))
    return next((variables[name] for name in _NAMES if name in variables), "")


def _is_own(name: str) -> bool:
    """Whether a socket can be bound to the address, or to one of those of the name."""
    try:
        found = socket.getaddrinfo(name, 0, type=socket.SOCK_DGRAM)
    except OSError:
        return False
    for family, kind, protocol, _, place in found:
        try:
            with socket.socket(family, kind, protocol) as one:
                one.bind(place)
        except OSError:
            continue
        return True
    return False


def judge(seen: Seen, host: str) -> Judged:
    """Warns of nodes to which others cannot connect, unless something translates the address."""
    if seen.own:
        return Judged("ok", f"its nodes advertise {seen.advertised}")
    has = f" (it has {', '.join(seen.addresses)})" if seen.addresses else ""
    text = f"its nodes advertise {seen.advertised}, which is no address of the host{has}"
    return Judged("warning", text, "correct its `address` in the spec, or give the host that address")
