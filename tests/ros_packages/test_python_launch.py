"""Python launch files are data: what they start is known without running them, or the reason why not."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.ros_packages import python_launch
from swarmctl.ros_packages.launch_description import evaluate
from swarmctl.ros_packages.launch_files import Launched, Node
from swarmctl.ros_packages.launch_values import NotReadError
from swarmctl.ros_packages.package import Package

HEAD = """
import os
from launch import LaunchDescription
from launch.actions import *
from launch_ros.actions import Node, PushRosNamespace
def generate_launch_description():
"""
NODE = "Node(package='p', executable='e', name='n')"


def launched(text: str, **more: str) -> Launched:
    files = {"main.launch.py": text, **more}
    contents = {name: one.encode() for name, one in files.items()}
    package = Package("own", "", frozenset(files), dict.fromkeys(files, False), contents)
    return evaluate(package, "main.launch.py", {"own": package}, {".py": python_launch.read}, limit=2000)


def body(text: str) -> Launched:
    """What a launch file with this function starts."""
    return launched(HEAD + "".join(f"    {line}\n" for line in text.strip().splitlines()))


def only(found: Launched) -> Node:
    [node] = found.nodes
    return node


@pytest.mark.parametrize(
    ("text", "names"),
    [
        (f"return LaunchDescription([{NODE}])", ["/n"]),
        (f"ld = LaunchDescription()\nld.add_action({NODE})\nreturn ld", ["/n"]),
        (
            (
                "names = ['a', 'b']\n"
                "return LaunchDescription([Node(package='p', executable='e', name=one) for one in names])"
            ),
            ["/a", "/b"],
        ),
        (
            (
                "made = []\nfor i, robot in enumerate([{'name': 'r'}, {'name': 'r'}], 1):\n"
                "    ns = f\"{robot['name']}_{i}\"\n"
                "    made.append(Node(package='p', executable='e', name='n', namespace=ns))\n"
                "return LaunchDescription(made)"
            ),
            ["/r_1/n", "/r_2/n"],
        ),
        (
            (
                "def make(name, *, last='x'):\n"
                "    return Node(package='p', executable='e', name=name + '_' + last)\n"
                "return LaunchDescription([make('a'), make('b', last='y')])"
            ),
            ["/a_x", "/b_y"],
        ),
        (
            (
                "ns = LaunchConfiguration('ns')\n"
                "return LaunchDescription([DeclareLaunchArgument('ns', default_value='lab'),\n"
                f"  GroupAction([PushRosNamespace(ns), {NODE}]), {NODE}])"
            ),
            ["/lab/n", "/n"],
        ),
        (
            (
                "def setup(context, *args):\n"
                "    count = int(LaunchConfiguration('count').perform(context))\n"
                "    return [Node(package='p', executable='e', name='n%d' % i) for i in range(count)]\n"
                "return LaunchDescription([DeclareLaunchArgument('count', default_value='2'),\n"
                "  OpaqueFunction(function=setup)])"
            ),
            ["/n0", "/n1"],
        ),
        (
            (
                f"return LaunchDescription([DeclareLaunchArgument('on', default_value='false'),\n"
                "  Node(package='p', executable='e', condition=IfCondition(LaunchConfiguration('on'))),\n"
                f"  TimerAction(period=2.0, actions=[{NODE}])])"
            ),
            ["/n"],
        ),
        (
            "x = 'a' if len([1]) > 0 else 'b'\nreturn LaunchDescription([Node(package='p', executable=x)])",
            ["/a"],
        ),
    ],
    ids=[
        "list",
        "add_action",
        "comprehension",
        "loop",
        "function",
        "namespace",
        "opaque",
        "condition",
        "choice",
    ],
)
def test_what_a_file_starts_is_known(text: str, names: list[str]) -> None:
    found = body(text)
    assert [one.name for one in found.nodes] == names
    assert all(one.certain for one in found.nodes)
    noted = {
        "it is not started: its condition is not true",
        "its period of 2.0 s; programs start when they can",
    }
    assert {why for _, why in found.left_out} <= noted


def test_parameters_have_the_types_of_python() -> None:
    values = "{'whole': 1, 'part': 1.0, 'on': True, 'text': '1', 'items': [1.5, 2.0], 'in': {'side': 'x'}}"
    node = only(body(f"return LaunchDescription([Node(package='p', executable='e', parameters=[{values}])])"))
    assert [(one.name, one.value, one.type) for one in node.parameters] == [
        ("whole", "1", "int"),
        ("part", "1.0", "double"),
        ("on", "true", "bool"),
        ("text", "1", "str"),
        ("items", "[1.5, 2.0]", "yaml"),
        ("in.side", "x", "str"),
    ]


def test_the_parameter_file_of_a_package_that_is_here_is_read() -> None:
    text = HEAD + (
        "    file = PathJoinSubstitution([FindPackageShare('own'), 'config', 'n.yaml'])\n"
        "    return LaunchDescription([Node(package='p', executable='e', name='n', parameters=[file])])\n"
    )
    values = (
        "/**: {ros__parameters: {rate: 5}}\nn: {ros__parameters: {frame: {id: odom}}}\n"
        "m: {ros__parameters: {no: 1}}\n"
    )
    node = only(launched(text, **{"config/n.yaml": values}))
    assert [(one.name, one.value, one.type) for one in node.parameters] == [
        ("rate", "5", "int"),
        ("frame.id", "odom", "str"),
    ]
    assert [why for _, why in launched(text).left_out] == [
        "its parameters of $(find-pkg-share own)/config/n.yaml, which is not here"
    ]


@pytest.mark.parametrize(
    ("values", "why"),
    [
        ("a: [", "which is no YAML of parameters"),
        (
            "x: &a0 {k: 1, l: 1}\n"
            + "".join(f"x{n}: &a{n} {{k: *a{n - 1}, l: *a{n - 1}}}\n" for n in range(1, 15))
            + "n: {ros__parameters: {z: *a14}}\n",
            "there is too much to read",
        ),
    ],
)
def test_a_parameter_file_that_cannot_be_read_is_named(values: str, why: str) -> None:
    node = "Node(package='p', executable='e', name='n', parameters=['n.yaml'])"
    found = launched(HEAD + f"    return LaunchDescription([{node}])\n", **{"n.yaml": values})
    assert any(why in one for _, one in found.left_out)
    assert len(only(found).parameters) <= 2000


def test_an_include_is_followed_or_known() -> None:
    include = (
        "IncludeLaunchDescription(PythonLaunchDescriptionSource({}), launch_arguments={{'ns': 'a'}}.items())"
    )
    there = "os.path.join(get_package_share_directory('{}'), 'launch', 'x.launch.py')"
    inner = HEAD + (
        "    return LaunchDescription([DeclareLaunchArgument('ns', default_value='b'),\n"
        "        Node(package='p', executable='e', namespace=LaunchConfiguration('ns'))])\n"
    )
    text = HEAD + f"    return LaunchDescription([{include.format(there.format('own'))}])\n"
    assert only(launched(text, **{"launch/x.launch.py": inner})).name == "/a/e"
    found = launched(HEAD + f"    return LaunchDescription([{include.format(there.format('driver'))}])\n")
    assert [(one.package, one.file, one.arguments) for one in found.includes] == [
        ("driver", "launch/x.launch.py", {"ns": "a"})
    ]


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (
            "if os.environ['MODEL'] == 'x':\n    y = 1\nreturn LaunchDescription()",
            "the environment variable MODEL",
        ),
        ("for one in os.listdir('/'):\n    pass\nreturn LaunchDescription()", "listdir()"),
        ("while True:\n    pass", "this statement is not evaluated"),
        ("return LaunchDescription([ExecuteProcess(cmd=['ros2', 'topic', 'list'])])", "it runs `ros2 topic"),
        ("x = [0] * 10 ** 9\nreturn LaunchDescription()", ""),
    ],
)
def test_what_is_not_known_has_its_reason_and_its_line(text: str, why: str) -> None:
    found = body(text)
    assert found.nodes == []
    assert (why == "" and not found.left_out) or any(
        why in one and place.line for place, one in found.left_out
    )


def test_no_statement_of_a_file_is_run(tmp_path: Path) -> None:
    file = tmp_path / "touched"
    found = body(
        f"open({str(file)!r}, 'w').write('x')\n__import__('os').system('touch {file}')\n"
        f"return LaunchDescription([{NODE}])"
    )
    assert (only(found).name, file.exists()) == ("/n", False)


@pytest.mark.parametrize(
    "text",
    [
        "def f(x):\n    return f(x)\nreturn LaunchDescription([f(1)])",
        "x = ['a' * 1000]\nfor i in range(10000):\n    x += x\nreturn LaunchDescription()",
        "x = 'a'\nfor i in range(60):\n    x = x + x\nreturn LaunchDescription([Node(package=x)])",
        "x = 9\nfor i in range(60):\n    x = x * x\nreturn LaunchDescription([Node(package=x)])",
        "x = LaunchConfiguration('a')\nfor i in range(60):\n    x = [x, x]\nreturn [Node(package=x)]",
        "x = 1\nfor i in range(60):\n    x = [x, x]\nreturn [Node(package=str(x), name=f'{x}')]",
        "x = 1\ny = 1\nfor i in range(60):\n    x = [x, x]\n    y = [y, y]\nreturn x == y",
        "x = 'a' * 5000\nreturn LaunchDescription([Node(package=x.replace('a', x))])",
        "return LaunchDescription([" + "[" * 60 + "]" * 60 + "])",
        "x = {}\nx['x'] = x\nreturn LaunchDescription([Node(package='p', executable='e', parameters=[x])])",
        "x = []\nx.append(x)\nreturn LaunchDescription(x)",
        "return '%*d' % (10**9, 1)",
        "return '{:>999999999}'.format(1)",
        "return f'{1:>99999999}'",
        "x = 10 ** 10 ** 10\nx = 2 * 10 ** 400 * 1.0\nreturn -x",
    ],
)
def test_a_hostile_file_ends_soon(text: str) -> None:
    assert len(body(text).nodes) <= 1


_WORDS = st.sampled_from(
    [
        "LaunchDescription([",
        "Node(",
        "package='p',",
        "executable=",
        "name=x",
        ")",
        "]",
        "{",
        "}",
        ":",
        ",",
        "for",
        "in",
        "if",
        "else",
        "lambda",
        "x",
        "y",
        "'a'",
        "1",
        "2.5",
        "None",
        "[0]",
        ".append(",
        ".items()",
        "+",
        "*",
        "%",
        "**",
        "not",
        "and",
        "==",
        "f'{x}'",
        "LaunchConfiguration('a')",
        "GroupAction(",
        "IncludeLaunchDescription(",
        "OpaqueFunction(function=",
        "return",
        "=",
        "+=",
        "\n",
    ]
)


@given(st.lists(_WORDS, max_size=25))
def test_any_text_is_read_or_refused(words: list[str]) -> None:
    text = HEAD + "    return " + " ".join(words)
    try:
        ast.parse(text)
    except (SyntaxError, ValueError):
        with pytest.raises(NotReadError):
            python_launch.read(text, lambda file: None)
    else:
        launched(text)


def test_a_file_that_python_warns_of_is_read_silently(recwarn: pytest.WarningsRecorder) -> None:
    assert only(body(f"x = '\\d'\nreturn LaunchDescription([{NODE}])")).name == "/n"
    assert not recwarn


ROBOTS = """
robots:
  - {name: tb_1, x: 0.5}
  - {name: tb_2, x: 1.5}
"""


def test_a_file_of_yaml_that_the_code_reads_is_data() -> None:
    text = """
import os, yaml
from ament_index_python.packages import get_package_share_directory
from launch_ros.actions import Node
def setup(context):
    path = LaunchConfiguration('fleet').perform(context)
    with open(path) as file:
        fleet = yaml.safe_load(file)
    return [Node(package='p', executable='e', name=one['name'], parameters=[{'x': one['x']}])
            for one in fleet['robots']]
def generate_launch_description():
    fleet = os.path.join(get_package_share_directory('own'), 'config', 'fleet.yaml')
    return LaunchDescription([
        DeclareLaunchArgument('fleet', default_value=fleet), OpaqueFunction(function=setup)])
"""
    found = launched(text, **{"config/fleet.yaml": ROBOTS})
    assert [(one.name, one.parameters[0].value) for one in found.nodes] == [
        ("/tb_1", "0.5"),
        ("/tb_2", "1.5"),
    ]
    assert "config/fleet.yaml" in found.files
    assert [str(place) for place, why in found.left_out if "main.launch.py reads it" in why] == [
        "config/fleet.yaml"
    ]
    one = only(launched(text))
    assert (one.name, one.package, one.executable, one.certain) == (None, "p", "e", False)


NAV = "slam: {ros__parameters: {frame: <ns>odom, rate: 5}}\n"


@pytest.mark.parametrize(
    ("source", "frame"),
    [
        ("ReplaceString(source_file='nav.yaml', replacements={'<ns>': ('tb_1', '/')})", "tb_1/odom"),
        (
            "ReplaceString('nav.yaml', {'<ns>': 'x'}, condition=UnlessCondition('true'))",
            "<ns>odom",
        ),
        (
            "PythonExpression(['\"nav.yaml\" if ', HasNodeParams('nav.yaml', 'slam'), ' else \"b.yaml\"'])",
            "<ns>odom",
        ),
    ],
)
def test_a_parameter_file_that_nav2_chooses_or_changes(source: str, frame: str) -> None:
    node = f"Node(package='p', executable='e', name='slam', parameters=[{source}])"
    node = only(launched(f"{HEAD}    return LaunchDescription([{node}])", **{"nav.yaml": NAV}))
    assert [(one.name, one.value) for one in node.parameters] == [("frame", frame), ("rate", "5")]


@pytest.mark.parametrize(
    ("package", "sections", "name"),
    [
        ("controller_manager", ("controller_manager", "diff_cont"), "/controller_manager"),
        ("ekf", ("ekf_filter_node",), "/ekf_filter_node"),
        ("p", ("a",), "/e"),
        ("p", ("a", "b"), "/e"),
        ("p", ("/**",), "/e"),
    ],
)
def test_a_node_without_a_name_has_that_of_its_parameter_file(
    package: str, sections: tuple[str, ...], name: str
) -> None:
    node = f"Node(package='{package}', executable='e', parameters=['p.yaml'])"
    file = "".join(f"{one}: {{ros__parameters: {{of: {one.strip('/*') or 'all'}}}}}\n" for one in sections)
    found = only(launched(f"{HEAD}    return LaunchDescription([{node}])", **{"p.yaml": file}))
    own = [name[1:]] if name[1:] in sections else ["all"] if "/**" in sections else []
    assert (found.name, [one.value for one in found.parameters]) == (name, own)
    assert not found.has_name


@pytest.mark.parametrize(
    ("process", "name", "words"),
    [
        ("cmd=['gzserver', '-s', LaunchConfiguration('w', default='x y')]", "/gzserver", "gzserver -s 'x y'"),
        (
            "cmd=[FindExecutable(name='MicroXRCEAgent'), 'udp4'], name='agent'",
            "/agent",
            "MicroXRCEAgent udp4",
        ),
        ("cmd=['ros2', 'bag', 'record', '/scan']", "/ros2", "ros2 bag record /scan"),
        ("cmd=['a b', 'c'], shell=True", "/bash", "bash -c 'a b c'"),
    ],
)
def test_a_process_is_a_command(process: str, name: str, words: str) -> None:
    node = only(body(f"return LaunchDescription([ExecuteProcess({process})])"))
    assert (node.name, node.package, f"{node.executable} {node.arguments}") == (name, "", words)
