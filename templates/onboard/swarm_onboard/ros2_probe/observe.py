"""The graph of ROS 2 as a node of this host sees it: a child process, as the agent has no ROS environment.

Fast DDS passes messages between processes of one host through shared memory. A process of another account may
be locked out of it, and one that is killed leaves its part there.

The node is hidden, subscribes to what is measured, and publishes nothing. It leaves when it has looked.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Mapping

import swarm_onboard
from swarm_onboard.agent import files, process_environment, processes
from swarm_onboard.agent.errors import FailedError
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.texts import clipped
from swarm_onboard.ros2_probe import look

if TYPE_CHECKING:
    from swarm_onboard.agent.verbs.probe import Answer, Request


SUPER_CLIENT = "env/super_client.xml"
UDP = {"FASTDDS_BUILTIN_TRANSPORTS": "UDPv4"}


def of_child(release: Mapping[str, str], current: str) -> dict[str, str]:
    """The variables of the node. ``release``: those of the release in the folder ``current``."""
    found = {**release, **UDP}
    if "ROS_DISCOVERY_SERVER" in release:
        found["ROS_SUPER_CLIENT"] = "TRUE"
        if Path(current, SUPER_CLIENT).exists():  # of Humble, which does not know the variable
            found["FASTRTPS_DEFAULT_PROFILES_FILE"] = f"{current}/{SUPER_CLIENT}"
    return found


_START = 10.0  # s until a slow board has loaded rclpy, and for leaving the graph
#: Of the look. Not that of nobody, under which other programs run: a firewall lets this one see the graph.
#: systemd gives no unit a number from 65520 on.
ACCOUNT = 65533
_OWNED = ("ROS_SECURITY_KEYSTORE", "SWARM_WORKSPACE")  # folders
_HOMELESS = {"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "LC_ALL": "C"}
_PYTHON = ("/usr/bin/python3", "-s", "-c")
_CODE = f"import sys; sys.path.insert(0, sys.argv[1]); from {look.__name__} import main; main()"


def observe(request: Request, answer: Answer) -> Answer:
    """Returns the answer with the graph. Raises ``RefusedError`` if no node of this host can join it."""
    current = home_of(request.swarm).current_link
    try:
        ports, udp = processes.listening_ports(), processes.udp_ports()
        answer = answer._replace(listening=ports, listening_udp=udp)
    except OSError as error:
        answer = answer._replace(troubles={**answer.troubles, "ports": clipped(error)})
    content = files.read(f"{current}/{process_environment.ROS}")
    if content is None:  # a host without a release, which is a finding of its own
        return answer
    release = process_environment.variables_in(content.decode("utf-8", "replace"))
    units = answer.units
    skipped = {
        node: unit for node, unit in request.skippable.items() if unit in units and units[unit].skipped
    }
    seen = _looked(request._replace(skippable=skipped), current, of_child(release, current))
    if "error" in seen:
        raise FailedError(clipped(seen["error"], 300))
    troubles = {**answer.troubles, **seen.pop("troubles", {})}
    return answer._replace(troubles=troubles, **seen)


def observe_logs(answer: Answer) -> Answer:
    """Returns the answer as it is: two nodes of one name do not end each other."""
    return answer


def _looked(request: Request, current: str, variables: Mapping[str, str]) -> Any:
    """What the child reports. Raises ``FailedError`` if it does not."""
    longest = look.longest(request) + _START
    archive = str(Path(swarm_onboard.__path__[0]).parent)
    with tempfile.TemporaryFile() as printed, tempfile.TemporaryFile() as complaints:
        child = subprocess.Popen(
            [*_account(variables), f"{current}/bin/ros-exec", *_PYTHON, _CODE, archive],
            stdin=subprocess.PIPE,
            stdout=printed,
            stderr=complaints,
            env={**_HOMELESS, **variables},
            start_new_session=True,
        )
        try:
            child.communicate(json.dumps(request._asdict()).encode("utf-8"), longest)
        except subprocess.TimeoutExpired:
            raise FailedError(f"the look at the graph took more than {longest:.0f} s") from None
        finally:
            with suppress(ProcessLookupError):
                os.killpg(child.pid, signal.SIGKILL)
            child.wait()
        lines, last = (_lines(file) for file in (printed, complaints))
    if child.returncode == 0 and lines:
        return json.loads(lines[-1])
    why = f"status {child.returncode}" + "".join(f", {line}" for line in last[-1:])
    raise FailedError(clipped(f"no node of this host can join the graph: {why}", 300))


def _lines(file: IO[bytes]) -> list[str]:
    file.seek(0)
    return file.read(look.LARGEST).decode("utf-8", "replace").strip().splitlines()


def _account(variables: Mapping[str, str]) -> list[str]:
    """The words that let a command run as who owns the keys of SROS 2 for people, or the workspace with the
    host's types, or under ``ACCOUNT``: never as root, as what a workspace sets up runs in it. None if the
    agent itself is not root.
    """
    if os.geteuid() != 0:
        return []
    places = (Path(one) for name in _OWNED for one in variables.get(name, "").split())
    owners = ((one.stat().st_uid, one.stat().st_gid) for one in places if one.is_dir())
    user, group = next((one for one in owners if one[0]), (ACCOUNT, ACCOUNT))
    return ["setpriv", f"--reuid={user}", f"--regid={group}", "--clear-groups", "--"]
