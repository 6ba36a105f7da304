"""The ROS variables of a running process, beside those of the release."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest
from swarm_onboard.agent.process_environment import FILE, differences
from swarm_onboard.agent.release_store import Home

from tests.onboard.agent.fakehost import RUNS

WANTED = {"ROS_MASTER_URI": "http://10.0.0.1:11311", "ROS_IP": "10.0.0.2"}
UNIT = "swarm-new.k3.service"
STATES = {
    unit: RUNS._replace(pid=pid)
    for unit, pid in ((UNIT, 42), ("swarm-new.target", 0), ("swarm-new.ended.service", 43))
}


def host(tmp_path: Path, seen: Mapping[str, str]) -> Home:
    home = Home("new", str(tmp_path))
    file = Path(home.current_link, FILE)
    file.parent.mkdir(parents=True)
    lines = (f'{name}="{text}"\n' for name, text in WANTED.items())
    file.write_text("# written by swarmctl\n" + "".join(lines))
    environ = tmp_path / "proc/42/environ"
    environ.parent.mkdir(parents=True)
    environ.write_text("".join(f"{name}={text}\0" for name, text in {"HOME": "/", **seen}.items()))
    return home


@pytest.mark.parametrize(
    ("seen", "found"),
    [
        (WANTED, []),
        ({**WANTED, "ROS_IP": "10.9.9.9"}, ["ROS_IP is 10.9.9.9 instead of 10.0.0.2"]),
        ({"ROS_IP": "10.0.0.2"}, ["ROS_MASTER_URI is not set, instead of http://10.0.0.1:11311"]),
        ({**WANTED, "ROS_IPV6": "on"}, ["ROS_IPV6 is on, and the release does not set it"]),
        ({**WANTED, "ROS_HOSTNAME": "pi"}, ["ROS_HOSTNAME is pi, and the release does not set it"]),
    ],
)
def test_what_differs_is_named(tmp_path: Path, seen: Mapping[str, str], found: list[str]) -> None:
    home = host(tmp_path, seen)
    assert differences(home, STATES, str(tmp_path / "proc")) == ({UNIT: found} if found else {})


def test_without_a_release_nothing_is_compared(tmp_path: Path) -> None:
    assert differences(Home("new", str(tmp_path)), STATES) == {}
