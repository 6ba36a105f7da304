"""The child process that looks at a graph of ROS 2, with a stand-in for rclpy."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest
from swarm_onboard.agent.errors import FailedError
from swarm_onboard.agent.process_environment import variables_in
from swarm_onboard.agent.systemd import UnitState
from swarm_onboard.agent.verbs.probe import Answer
from swarm_onboard.ros2_probe import look, observe

from swarmctl.resources import templates
from tests.onboard.ros2_probe.test_endpoints import request


@pytest.fixture
def host(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current release of a host, whose agent is not root: no other account reads the folder."""
    monkeypatch.setenv("SWARM_PREFIX", str(tmp_path))
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    current = tmp_path / "opt/swarm/new/current"
    (current / "env").mkdir(parents=True)
    (current / "bin").mkdir()
    (current / "env/ros.env").write_text('ROS_DISTRO="none"\nSWARM_WORKSPACE=""\n')
    (current / "bin/ros-exec").write_text((templates() / "ros2/ros-exec").read_text())
    (current / "bin/ros-exec").chmod(0o755)
    return current


def seen(host: Path) -> Answer:
    return observe.observe(request(), Answer())


def test_a_host_without_rclpy_says_so(host: Path) -> None:
    with pytest.raises(FailedError, match="rclpy cannot be imported: No module named 'rclpy'"):
        seen(host)


def test_a_host_without_a_release_has_no_graph(host: Path) -> None:
    (host / "env/ros.env").unlink()
    found = seen(host)
    assert found == Answer(listening=found.listening, listening_udp=found.listening_udp)


def test_a_release_without_its_start_is_no_traceback(host: Path) -> None:
    (host / "bin/ros-exec").write_text("#!/bin/sh\necho broken >&2\nexit 3\n")
    with pytest.raises(FailedError, match="no node of this host can join the graph: status 3, broken"):
        seen(host)


def test_a_child_that_hangs_is_ended(host: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (host / "bin/ros-exec").write_text(f"#!/bin/sh\necho $$ > {host}/pid\nsleep 600 & wait\n")
    monkeypatch.setattr(observe, "_START", 0.2)
    monkeypatch.setattr(look, "longest", lambda _: 0.2)
    with pytest.raises(FailedError, match="the look at the graph took more than"):
        seen(host)
    with pytest.raises(ProcessLookupError):
        os.kill(int((host / "pid").read_text()), 0)


def test_what_it_prints_is_the_answer(host: Path) -> None:
    """Whatever a library prints before."""
    answer = '{"seen": 3, "troubles": {"ros": "no type"}}'
    (host / "bin/ros-exec").write_text(f"#!/bin/sh\ncat >/dev/null\necho noise\necho '{answer}'\n")
    found = seen(host)
    assert (found.seen, found.troubles) == (3, {"ros": "no type"})
    assert isinstance(found.listening_udp, list)


def test_a_node_is_not_waited_for_while_its_unit_is_skipped(host: Path) -> None:
    (host / "bin/ros-exec").write_text(f"#!/bin/sh\ncat >{host}/request\necho '{{}}'\n")
    state = UnitState("loaded", "inactive", "dead", "", "", 0, 0)
    units = {"skipped": state._replace(skipped=True), "failed": state}
    wanted = request(skippable={"/a": "skipped", "/b": "failed", "/c": "unknown"})
    observe.observe(wanted, Answer(units=units))
    assert json.loads((host / "request").read_text())["skippable"] == {"/a": "skipped"}


def test_it_sees_the_whole_graph_without_shared_memory(tmp_path: Path) -> None:
    release = variables_in('A="x \\"y\\""\n# no\nROS_DISCOVERY_SERVER="10.0.0.1:11811;10.0.0.2:11811"\n')
    assert release == {"A": 'x "y"', "ROS_DISCOVERY_SERVER": "10.0.0.1:11811;10.0.0.2:11811"}
    found = observe.of_child(release, str(tmp_path))
    assert (found["ROS_SUPER_CLIENT"], found["FASTDDS_BUILTIN_TRANSPORTS"]) == ("TRUE", "UDPv4")
    assert "ROS_SUPER_CLIENT" not in observe.of_child({}, str(tmp_path))
    (tmp_path / "env").mkdir()
    file = tmp_path / observe.SUPER_CLIENT
    file.touch()
    assert observe.of_child(release, str(tmp_path))["FASTRTPS_DEFAULT_PROFILES_FILE"] == str(file)


def test_the_child_runs_as_who_owns_the_workspace_and_never_as_root(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    own = ["setpriv", "--reuid=65533", "--regid=65533", "--clear-groups", "--"]
    assert observe._account({}) == own
    if os.getuid() == 0:
        assert observe._account({"SWARM_WORKSPACE": str(tmp_path)}) == own
        os.chown(tmp_path, 1234, 1235)
        assert observe._account({"SWARM_WORKSPACE": str(tmp_path)})[1:3] == ["--reuid=1234", "--regid=1235"]


@pytest.mark.skipif(os.getuid() != 0, reason="only root gives folders away")
@pytest.mark.parametrize(
    ("owner", "expected"), [(1234, 1234), (0, 4321), (None, 4321)], ids=["theirs", "of root", "none"]
)
def test_with_sros2_the_child_runs_as_who_has_the_keys_of_people(
    owner: int | None, expected: int, tmp_path: Path
) -> None:
    """Without their folder it runs as ever, and says what ROS says of missing keys."""
    keys, workspace = tmp_path / "swarm-new.enclaves", tmp_path / "ws"
    for folder, account in ((keys, owner), (workspace, 4321)):
        if account is not None:
            folder.mkdir()
            os.chown(folder, account, account)
    variables = {"SWARM_WORKSPACE": str(workspace), "ROS_SECURITY_KEYSTORE": str(keys)}
    assert observe._account(variables)[1:3] == [f"--reuid={expected}", f"--regid={expected}"]


def test_the_child_looks_in_the_enclave_of_people(host: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever unit the agent itself runs in."""
    monkeypatch.setenv("CREDENTIALS_DIRECTORY", "/nowhere")
    monkeypatch.setenv("SWARM_ENCLAVE", "robots/k3")
    with (host / "env/ros.env").open("a") as file:
        file.write('ROS_SECURITY_KEYSTORE="/run/keys"\nROS_SECURITY_ENCLAVE_OVERRIDE="/hosts/pi"\n')
    text = (host / "bin/ros-exec").read_text()
    shows = 'cat >/dev/null\necho "{\\"seen\\": \\"$ROS_SECURITY_KEYSTORE$ROS_SECURITY_ENCLAVE_OVERRIDE\\"}"'
    (host / "bin/ros-exec").write_text(text.replace('exec "$@"', shows))
    assert seen(host).seen == "/run/keys/hosts/pi"
