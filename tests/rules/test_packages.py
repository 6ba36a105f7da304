"""Packages beside a spec: messages (PKG014), workspaces of the operator, and what is never read."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from swarmctl.linter.launch_uses import launch_uses
from swarmctl.swarm.index import SwarmIndex
from tests.loading import load_checked
from tests.ros_packages.packages import manifest
from tests.timing import work_at_most

SPEC = """\
version: 1
name: newswarm
mode: leader
leader: koala-laptop
hosts:
  koala-laptop: {{address: 192.168.77.10}}
robots:
  koala: {{type: koala, host: koala-laptop}}
links:
  - {{kind: serial, host: koala-laptop, robot: koala, usb: {{serial: A600dXyz}}}}
control:
  - {{by: koala-laptop, of: [koala]}}
programs:
  own: {{robot: koala, package: own, {program}}}
"""
TWIST = "Vector3 linear\nVector3 angular\n"
VECTOR = "float64 x\nfloat64 y\nfloat64 z\n"


def write(root: Path, files: dict[str, str]) -> None:
    for path, text in files.items():
        (root / path).parent.mkdir(parents=True, exist_ok=True)
        (root / path).write_text(text)


def spec(folder: Path, program: str = "executable: go.py") -> Path:
    write(folder, {"swarm.yaml": SPEC.format(program=program)})
    return folder / "swarm.yaml"


def codes(path: Path, *workspaces: Path) -> list[str]:
    return [one.code for one in load_checked(path, workspaces=workspaces)[1]]


def topic(kind: str) -> str:
    return f"executable: go.py, publishes: [{{topic: thing, type: {kind}}}]"


def test_a_copy_of_a_common_message_that_differs(tmp_path: Path) -> None:
    own = spec(tmp_path, topic("geometry_msgs/Twist"))
    write(
        tmp_path / "geometry_msgs",
        {"package.xml": manifest("geometry_msgs"), "msg/Twist.msg": TWIST, "msg/Vector3.msg": VECTOR},
    )
    assert codes(own) == []
    write(tmp_path / "geometry_msgs", {"msg/Twist.msg": TWIST + "float64 weight\n"})
    assert codes(own) == ["PKG014"]


def test_two_copies_of_a_package_that_differ(tmp_path: Path) -> None:
    own = spec(tmp_path / "lab", topic("own/Counts"))
    write(tmp_path / "lab/own", {"package.xml": manifest("own"), "msg/Counts.msg": "int8 a\n", "go.py": ""})
    write(tmp_path / "ws/own", {"package.xml": manifest("own"), "msg/Counts.msg": "int8 a # same\n"})
    (tmp_path / "lab/own/go.py").chmod(0o755)
    assert codes(own, tmp_path / "ws") == []
    write(tmp_path / "ws/own", {"msg/Counts.msg": "int16 a\n"})
    assert codes(own, tmp_path / "ws") == ["PKG014"]


def test_the_messages_of_a_package_beside_the_spec_are_known(tmp_path: Path) -> None:
    write(tmp_path / "own", {"package.xml": manifest("own"), "msg/Counts.msg": "int8 a\n", "go.py": ""})
    (tmp_path / "own/go.py").chmod(0o755)
    assert codes(spec(tmp_path, topic("own/Counts"))) == []
    assert codes(spec(tmp_path, topic("own/Count"))) == ["TOPIC007"]


def test_a_workspace_is_read_where_the_operator_names_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own = spec(tmp_path / "lab")
    write(tmp_path / "ws/src/own", {"package.xml": manifest("own"), "scripts/stop.py": ""})
    assert codes(own) == []
    arguments = ["validate", str(own), "--workspace", str(tmp_path / "ws"), "--json"]
    assert run(arguments) == exit_codes.ERROR
    (found,) = json.loads(capsys.readouterr().out)["diagnostics"]
    assert found["code"] == "PKG001"
    assert str(tmp_path / "ws/src/own") in found["message"]


def test_a_workspace_on_the_hosts_is_not_read(tmp_path: Path) -> None:
    own = spec(tmp_path / "lab")
    own.write_text(own.read_text() + f"ros: {{workspace: {tmp_path}/ws}}\n")
    write(tmp_path / "ws/src/own", {"package.xml": manifest("own"), "scripts/stop.py": ""})
    assert codes(own) == []


def test_hostile_launch_files_end_soon(tmp_path: Path) -> None:
    twice = '<include file="$(find own)/launch/a.launch" />' * 2
    nested = "<group>" * 30 + "</group>" * 30
    write(
        tmp_path / "own",
        {
            "package.xml": manifest("own"),
            "launch/a.launch": f"<launch>{twice}{nested * 500}</launch>",
            "CMakeLists.txt": "install(PROGRAMS " * 10_000 + "add_executable(" * 10_000,
            "msg/A.msg": "own/B b\n" + "".join(f"own/M{n} m{n}\n" for n in range(5000)),
            "msg/B.msg": "own/A a\n",
        },
    )
    own = spec(tmp_path, "launch: a.launch")
    lines = "".join(f"  p{n}: {{robot: koala, package: own, launch: a.launch}}\n" for n in range(300))
    own.write_text(own.read_text() + lines)
    with work_at_most(300):
        load_checked(own)


@pytest.mark.parametrize(("argument", "clash"), [('"{robot}"', False), ("cart", True)])
def test_launch_files_have_the_arguments_of_each_robot(argument: str, clash: bool, tmp_path: Path) -> None:
    """Two robots start a node with an absolute name, which an argument sets."""
    carts = f"driver: {{package: carts, launch: cart.launch, args: {{name: {argument}}}}}"
    types = f"types:\n  cart:\n    {carts}\n    kinematics: {{kind: none}}\n    title: A cart\n"
    robots = (
        "robots:\n  cart-1: {type: cart, host: koala-laptop}\n  cart-2: {type: cart, host: koala-laptop}\n"
    )
    text = SPEC.format(program="executable: go.py").replace("robots:\n", types + robots)
    launch = (
        '<launch><arg name="name" /><group ns="/$(arg name)">'
        '<node pkg="carts" type="go" name="go" /></group></launch>'
    )
    write(
        tmp_path,
        {"swarm.yaml": text, "carts/package.xml": manifest("carts"), "carts/launch/cart.launch": launch},
    )
    assert ("PKG008" in codes(tmp_path / "swarm.yaml")) is clash


LAUNCHED = """\
<launch>
  <arg name="namespace" default="" />
  <group{ns}><node pkg="own" type="go.py" name="go" /></group>
</launch>
"""
PUSHES = ' ns="$(arg namespace)"'


@pytest.mark.parametrize(
    ("pushes", "program", "node"),
    [
        (PUSHES, 'args: {namespace: "{namespace}"}', "/koala/koala/go"),
        (PUSHES, "args: {namespace: arm}", "/koala/arm/go"),
        (PUSHES, "args: {namespace: /koala}", "/koala/go"),
        (PUSHES, "namespace_argument: namespace", "/koala/go"),
        ("", "args: {namespace: koala}", "/koala/go"),  # the file does something else with it
    ],
)
def test_a_namespace_is_set_twice_if_the_file_sets_it(
    tmp_path: Path, pushes: str, program: str, node: str
) -> None:
    launched = LAUNCHED.format(ns=pushes)
    write(tmp_path / "own", {"package.xml": manifest("own"), "launch/own.launch": launched, "go.py": ""})
    (tmp_path / "own/go.py").chmod(0o755)
    own = spec(tmp_path, f"launch: own.launch, {program}")
    document, found = load_checked(own)
    assert [one.code for one in found] == ([] if node == "/koala/go" else ["PKG023"])
    assert document is not None
    (use,) = launch_uses(SwarmIndex(document))
    assert [one.name for one in use.launched.nodes] == [node]


def test_a_wrong_namespace_argument_is_found_at_its_place(tmp_path: Path) -> None:
    launched = LAUNCHED.format(ns=PUSHES)
    write(tmp_path / "own", {"package.xml": manifest("own"), "launch/own.launch": launched})
    own = spec(tmp_path, "launch: own.launch, namespace_argument: namespce")
    [found] = [one for one in load_checked(own)[1] if one.code == "PKG005"]
    assert found.span is not None
    assert own.read_text().splitlines()[found.span.line - 1][found.span.column - 1 :] == "namespce}"
    assert found.fix is not None
    assert found.fix.title == "write `namespace`"
