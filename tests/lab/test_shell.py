"""The lines of `lab shell`: a text is a line for a shell, and hosts have the ROS of their swarm."""

from __future__ import annotations

import subprocess
from pathlib import Path

from swarmctl.lab.lab import host_line, operator_argv, setup_file


def run_line(line: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ("bash", "-c", line), env={"PATH": "/usr/bin:/bin", **environment}, capture_output=True, text=True,
        check=False,
    )  # fmt: skip


def test_a_single_text_of_the_operator_is_a_line(tmp_path: Path) -> None:
    argv = operator_argv((f"cd {tmp_path}; pwd && exit 3",), "/bin/sh")
    done = subprocess.run(argv, capture_output=True, text=True, check=False)
    assert (done.stdout, done.returncode) == (f"{tmp_path}\n", 3)


def test_several_words_of_the_operator_stay_as_they_are() -> None:
    assert operator_argv(("echo", "a  b; c"), "/bin/sh") == ("echo", "a  b; c")
    assert operator_argv((), "/bin/zsh") == ("/bin/zsh",)


def test_a_command_on_a_host_has_ros(tmp_path: Path) -> None:
    setup = tmp_path / "set up.bash"
    setup.write_text("export ROS_MASTER_URI=http://10.0.0.1:11311\n")
    done = run_line(host_line(str(setup), ["cd /;", 'echo "$PWD $ROS_MASTER_URI";', "exit 4"]))
    assert (done.stdout, done.stderr, done.returncode) == ("/ http://10.0.0.1:11311\n", "", 4)


def test_a_shell_on_a_host_has_ros(tmp_path: Path) -> None:
    setup = tmp_path / "setup.bash"
    setup.write_text("export ROS_IP=10.0.0.2\n")
    done = run_line(host_line(str(setup), []) + " -c 'echo $ROS_IP'", SHELL="/bin/sh")
    assert done.stdout == "10.0.0.2\n"


def test_a_host_before_its_first_deploy_has_a_shell(tmp_path: Path) -> None:
    done = run_line(host_line(str(tmp_path / "none"), ["echo", "here"]))
    assert (done.stdout, done.stderr) == ("here\n", "")
    assert setup_file("garden") == "/opt/swarm/garden/current/setup.bash"
