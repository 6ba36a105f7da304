from __future__ import annotations

from pathlib import Path

import pytest
from swarm_onboard.agent.release_store import Home
from swarm_onboard.host_checks.address import judge, observe


def host(folder: Path, *lines: str) -> Home:
    """A host whose release has these lines in the environment of its nodes."""
    home = Home("new", str(folder))
    env = Path(home.current_link, "env/ros.env")
    env.parent.mkdir(parents=True)
    env.write_text("".join(f"{line}\n" for line in lines))
    return home


@pytest.mark.parametrize("line", ["ROS_IP=127.0.0.1", "ROS_HOSTNAME=localhost"])
def test_an_address_of_the_host_is_right(tmp_path: Path, line: str) -> None:
    (found,) = observe(host(tmp_path, "ROS_MASTER_URI=http://10.0.0.1:11311", line))
    assert judge(found, "pi").state == "ok"


@pytest.mark.parametrize("line", ["ROS_IP=192.0.2.7", "ROS_HOSTNAME=name.invalid"])
def test_another_address_is_a_warning_with_those_of_the_host(tmp_path: Path, line: str) -> None:
    (found,) = observe(host(tmp_path, line))
    judged = judge(found._replace(addresses=["10.0.0.5", "fd00::5"]), "pi")
    assert judged.state == "warning"
    advertised = line.partition("=")[2]
    assert (
        f"advertise {advertised}, which is no address of the host (it has 10.0.0.5, fd00::5)"
        in judged.message
    )


@pytest.mark.parametrize("lines", [[], ["ROS_DOMAIN_ID=7"]])
def test_a_host_without_such_a_variable_has_no_finding(tmp_path: Path, lines: list[str]) -> None:
    assert observe(host(tmp_path, *lines)) == []
