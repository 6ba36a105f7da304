"""What launch files of ROS 2 start and set is in the draft as launch, rclcpp and Nav2 have it."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.importing.drafts import data, draft, lab


def launch(*actions: str, before: str = "") -> str:
    """A Python launch file with these actions."""
    return (
        f"def generate_launch_description():\n{before}    return LaunchDescription([{', '.join(actions)}])\n"
    )


def test_what_a_branch_or_a_list_decides_is_to_fill_in(tmp_path: Path) -> None:
    text = """
def generate_launch_description():
    ld = LaunchDescription()
    if os.environ.get('LIDAR') == 'a':
        lidar = Node(package='a', executable='lidar', name='a')
    else:
        lidar = Node(package='b', executable='lidar', name='b')
    ld.add_action(lidar)
    for robot in os.listdir('robots'):
        ld.add_action(Node(package='p', executable='driver', name=robot))
    remaps = [('/tf', 'tf')]
    if os.path.exists('/dev/imu'):
        remaps.append(('/imu', 'imu'))
        ld.add_action(Node(package='p', executable='imu', name='imu'))
    ld.add_action(Node(package='p', executable='n', name='n', remappings=remaps))
    return ld
"""
    made = draft(lab(tmp_path, {"a.launch.py": text}))
    assert data(made)["programs"] == {
        "n": {"host": "robot-pc", "package": "p", "executable": "n", "remap": {"/tf": "tf"}}
    }
    on, whether = "host: robot-pc", "whether it applies depends on"
    env, exists = "the environment variable LIDAR", "exists()"
    for line in (
        f"  # a: {{{on}, package: a, executable: lidar}}  # fill in: a.launch.py:5: {whether} {env}",
        f"  # b: {{{on}, package: b, executable: lidar}}  # fill in: a.launch.py:7: {whether} {env}",
        f"  # driver: {{{on}, package: p, executable: driver}}  # fill in: a.launch.py:10: `name` depends on",
        f"  # imu: {{{on}, package: p, executable: imu}}  # fill in: a.launch.py:14: {whether} {exists}",
        f"#   a.launch.py:15: a remapping depends on {exists}",
    ):
        assert line in made.text


def test_what_returns_early_is_to_fill_in(tmp_path: Path) -> None:
    text = """
def setup(context):
    if os.environ['SIM'] == '1':
        return [Node(package='p', executable='sim', name='sim')]
    return [Node(package='p', executable='real', name='real')]

def generate_launch_description():
    return LaunchDescription([OpaqueFunction(function=setup), Node(package='p', executable='n', name='n')])
"""
    made = draft(lab(tmp_path, {"a.launch.py": text}))
    assert [*data(made)["programs"]] == ["n"]
    assert "  # sim: {" in made.text
    assert "  # real: {" in made.text


def test_what_perhaps_starts_has_its_own_arguments(tmp_path: Path) -> None:
    text = """
def generate_launch_description():
    if os.environ.get('ROBOT') is None:
        return
    return LaunchDescription([
        DeclareLaunchArgument('map', default_value='lab.yaml'),
        Node(package='p', executable='e', name='server', parameters=[{'map': LaunchConfiguration('map')}]),
    ])
"""
    made = draft(
        lab(tmp_path, {"a.launch.py": text, "b.launch.py": launch("Node(package='p', executable='e')")})
    )
    shown = "# server: {host: robot-pc, package: p, executable: e, params: {map: lab.yaml}}"
    assert f"  {shown}  # fill in: a.launch.py:7: whether it applies depends on" in made.text


def test_an_include_is_no_scope(tmp_path: Path) -> None:
    """What it sets holds after it, but not after a group around it."""
    include = "IncludeLaunchDescription('inner.launch.xml', launch_arguments={'rate': '7'}.items())"
    node = "Node(package='p', executable='e', name='%s', parameters=[{'rate': LaunchConfiguration('rate')}])"
    files = {
        "inner.launch.xml": '<launch><arg name="rate"/><node pkg="p" exec="i" name="i"/></launch>',
        "a.launch.py": launch(
            "DeclareLaunchArgument('rate', default_value='3')", f"GroupAction([{include}])", node % "before",
            include, node % "after",
        ),
    }  # fmt: skip
    programs = data(draft(lab(tmp_path, files)))["programs"]
    assert [programs[name]["params"] for name in ("before", "after")] == [{"rate": 3}, {"rate": 7}]


def test_a_default_that_an_include_before_it_replaces_is_named(tmp_path: Path) -> None:
    node = '<node pkg="p" exec="{0}" name="{0}" args="$(var file)"/>'
    inner = f'<launch><arg name="file" default="{{0}}"/>{node}</launch>'
    include = '<include file="$(dirname)/{}.launch.xml"/>'
    files = {f"{one}.launch.xml": inner.format(one) for one in ("one", "two")}
    both = f"{include.format('one')}{include.format('two')}"
    made = draft(lab(tmp_path, {**files, "a.launch.xml": f"<launch>{both}</launch>"}))
    assert [one["args"] for one in data(made)["programs"].values()] == [["one"], ["one"]]
    why = "one.launch.xml, which is included before in the same scope, sets it otherwise"
    assert f"#   two.launch.xml:1: the default of file is not used: {why}\n" in made.text


PARAMS = """
/**: {ros__parameters: {of: all}}
n: {ros__parameters: {of: the root}}
r: {n: {ros__parameters: {of: r}}}
/*/m: {ros__parameters: {of: any}}
"""


def test_a_node_reads_the_sections_of_its_full_name(tmp_path: Path) -> None:
    nodes = [
        f"Node(package='p', executable='e', name='{name}', namespace='{namespace}', parameters=[{file}])"
        for name, namespace, file in (
            ("n", "", "'p.yaml'"),
            ("n", "r", "'p.yaml'"),
            ("m", "q", "'p.yaml'"),
            ("n", "s", "'p.yaml'"),
            ("n", "t", "RewrittenYaml('p.yaml', root_key='t', param_rewrites={})"),
        )
    ]
    made = draft(lab(tmp_path, {"a.launch.py": launch(*nodes), "p.yaml": PARAMS}))
    found = [one["params"]["of"] for one in data(made)["programs"].values()]
    assert found == ["the root", "r", "any", "all", "the root"]


def test_values_of_a_substitution_are_read_as_yaml(tmp_path: Path) -> None:
    xml = "".join(
        f'<param name="p{number}" value="{value}"/>'
        for number, value in enumerate(("2", "on", "''", "[a, b]", "[1, x]", "{a: 1}", "1e400"))
    )
    node = f'<launch><node pkg="p" exec="e" name="n">{xml}</node></launch>'
    programs = data(draft(lab(tmp_path, {"a.launch.xml": node})))["programs"]
    assert [*programs["n"]["params"].values()] == [
        2, True, "", ["a", "b"], "[1, x]", "{{a: 1}}", "1e400",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "path"),
    [
        ("Path(get_package_share_directory('own')) / 'config' / 'p.yaml'", "config/p.yaml"),
        ("Path(__file__).parent.parent.joinpath('config', 'p.yaml').resolve()", "config/p.yaml"),
        ("os.path.join(os.path.dirname(os.path.dirname(__file__)), 'config/p.yaml')", "config/p.yaml"),
        ("FindPackageShare(package='own').find('own') + '/config/p.yaml'", "config/p.yaml"),
        ("'/home/robot/ws/install/p.yaml'", "config/p.yaml"),
    ],
)
def test_a_parameter_file_is_found_by_its_path(text: str, path: str, tmp_path: Path) -> None:
    files = {
        "own/package.xml": "<package><name>own</name></package>",
        "own/launch/a.launch.py": launch(f"Node(package='p', executable='e', name='n', parameters=[{text}])"),
        f"own/{path}": "n: {ros__parameters: {speed: 0.5}}\n",
    }
    assert data(draft(lab(tmp_path, files)))["programs"]["n"]["params"] == {"speed": 0.5}


def test_what_starts_a_program_is_named(tmp_path: Path) -> None:
    node = '<launch><arg name="go"/><node pkg="p" exec="e" name="robot" if="$(var go)"/></launch>'
    outer = (
        '<launch><include file="$(dirname)/inner.launch.xml"><arg name="go" value="{}"/></include></launch>'
    )
    files = {"inner.launch.xml": node, **{f"{go}.launch.xml": outer.format(go) for go in ("true", "false")}}
    made = draft(lab(tmp_path, files))
    assert "  robot:  # from inner.launch.xml:1, started by true.launch.xml\n" in made.text
    assert "it is not started" not in made.text  # by the other one


def test_xml_launch_files_have_any_name(tmp_path: Path) -> None:
    node = '<launch><node pkg="p" exec="e" name="{}"/></launch>'
    files = {"launch/rover_launch.xml": node.format("a"), "launch/multi_launch_1.xml": node.format("b")}
    assert {*data(draft(lab(tmp_path, files)))["programs"]} == {"a", "b"}


def test_each_value_of_ros_has_its_place(tmp_path: Path) -> None:
    files = {
        "Dockerfile": "FROM ros:humble\n",
        "env.sh": "\nexport ROS_DOMAIN_ID=4\n",
        "start.sh": "ros2 run p e\n",
    }
    made = draft(lab(tmp_path, files))
    assert "ros: {distro: humble, domain: 4}  # from Dockerfile:1, domain: env.sh:2\n" in made.text


def test_the_readme_may_name_the_distribution(tmp_path: Path) -> None:
    files = {
        "README.md": "# Lab\nInstall ROS 2 Humble.\n",
        "start.sh": "ros2 run p e\necho /opt/ros/jazzy/\n",
    }
    made = draft(lab(tmp_path, files))
    assert "ros: {distro: humble}  # guess: README.md is about Humble; check" in made.text


def test_what_a_simulation_starts_is_a_guess(tmp_path: Path) -> None:
    node = '<launch><node pkg="p" exec="{0}" name="{0}"/></launch>'
    include = '<launch><include file="$(find-pkg-share gz)/launch/gz.launch.py"/></launch>'
    files = {
        "launch/real.launch.xml": node.format("real"),
        "sim/launch/start.launch.xml": node.format("twin"),
    }
    made = draft(lab(tmp_path / "both", {**files, "launch/sim.launch.xml": include}))
    why = "guess: it is of a simulation, or an old one, by the name of what starts it"
    for line in (
        "  real:  # from launch/real.launch.xml:1\n",
        f"  twin:  # {why} (sim/launch/start.launch.xml:1); check",
        f"  gz:  # {why} (launch/sim.launch.xml:1); check",
    ):
        assert line in made.text
    assert why not in draft(lab(tmp_path / "alone", {"launch/sim.launch.xml": include})).text


def test_known_words_of_arguments_are_kept(tmp_path: Path) -> None:
    words = "'-x', '0.5', '--model', EnvironmentVariable('MODEL')"
    made = draft(
        lab(
            tmp_path,
            {"a.launch.py": launch(f"Node(package='p', executable='e', name='node', arguments=[{words}])")},
        )
    )
    shown = 'args: ["-x", "0.5", "--model", "..."]'
    assert f"    # {shown}  # fill in: a.launch.py:2: `args` depends on $(env MODEL)\n" in made.text


def test_a_reason_is_that_of_what_starts_it(tmp_path: Path) -> None:
    """One launch file gives the argument, and another one does not."""
    node = '<node pkg="p" exec="e" name="node" namespace="$(var robot)"/>'
    include = '<include file="$(dirname)/inner.launch.xml">'
    files = {
        "inner.launch.xml": f'<launch><arg name="robot"/>{node}</launch>',
        "a.launch.xml": f"<launch>{include}</include></launch>",
        "b.launch.xml": f'<launch>{include}<arg name="robot" value="tb"/></include></launch>',
    }
    made = draft(lab(tmp_path, files))
    assert [one.get("namespace") for one in data(made)["programs"].values()] == [None, "tb"]
    assert made.text.count("`namespace` depends on the argument `robot`") == 1


def test_a_variable_of_a_script_that_runs_other_programs_is_a_guess(tmp_path: Path) -> None:
    files = {"start.sh": "ros2 run p e\n", "check.sh": "export ROS_DOMAIN_ID=4\ndocker run image\n"}
    made = draft(lab(tmp_path, files))
    assert (
        "domain: 4}  # guess: no file names the distribution; domain: check.sh sets it for what it runs"
        in made.text
    )
    files["check.sh"] = "export ROS_DOMAIN_ID=4\n"
    assert "check.sh sets it" not in draft(lab(tmp_path, files)).text


def test_a_key_that_a_parameter_file_has_twice_adds_to_it(tmp_path: Path) -> None:
    """As in rcl: not the last one alone, as in Python."""
    file = "/**:\n  a: {ros__parameters: {x: 1}}\n/**:\n  b: {ros__parameters: {x: 2}}\n"
    nodes = [f"Node(package='p', executable='e', name='{name}', parameters=['p.yaml'])" for name in "ab"]
    made = draft(lab(tmp_path, {"a.launch.py": launch(*nodes), "p.yaml": file}))
    assert [one["params"] for one in data(made)["programs"].values()] == [{"x": 1}, {"x": 2}]


def test_a_switch_is_no_secret(tmp_path: Path) -> None:
    params = "{'low_pass_filter': 0.5, 'use_password': 'true', 'password': 'hunter2'}"
    node = f"Node(package='p', executable='e', name='node', parameters=[{params}])"
    made = draft(lab(tmp_path, {"a.launch.py": launch(node)}))
    assert data(made)["programs"]["node"]["params"] == {"low_pass_filter": 0.5, "use_password": "true"}


def test_what_replaces_a_value_and_is_not_known_leaves_none(tmp_path: Path) -> None:
    params = "'p.yaml', {'map': EnvironmentVariable('MAP')}"
    files = {
        "a.launch.py": launch(f"Node(package='p', executable='e', name='node', parameters=[{params}])"),
        "p.yaml": "node: {ros__parameters: {map: old.yaml, rate: 5}}\n",
    }
    assert data(draft(lab(tmp_path, files)))["programs"]["node"]["params"] == {"rate": 5}


@pytest.mark.parametrize(
    "action",
    [
        "Node(package='p', executable='e', arguments=[EnvironmentVariable('PWD', default_value='hunter2')])",
        "DeclareLaunchArgument('wifi_password', default_value='hunter2')",
        "ExecuteProcess(cmd=['ros2', 'param', 'set', '/n', '\"wifi_password\"', 'hunter2'])",
        "IncludeLaunchDescription('x.py', launch_arguments=[('f', RewrittenYaml('p', {'psk': 'hunter2'}))])",
    ],
)
def test_a_reason_shows_no_secret(action: str, tmp_path: Path) -> None:
    made = draft(
        lab(tmp_path, {"a.launch.py": launch("Node(package='p', executable='e', name='m')", action)})
    )
    assert "hunter2" not in made.text
    assert "secret" in made.text


BOMB = "a0: &a0 {k: {}}\n" + "".join(
    f"a{n}: &a{n} {{{', '.join(f'x{i}: *a{n - 1}' for i in range(10))}}}\n" for n in range(1, 14)
)
MERGES = "a0: &a0 {k: 1}\n" + "".join(f"a{n}: &a{n} {{<<: [*a{n - 1}, *a{n - 1}]}}\n" for n in range(1, 40))


@pytest.mark.parametrize(
    ("body", "params"),
    [
        ("Node(package='p', executable='e', name='n', parameters=['p.yaml'])", BOMB),
        ("Node(package='p', executable='e', name='n', parameters=['p.yaml'])", MERGES),
        (
            "Node(package='p', executable='e', name='n', parameters=['p.yaml'])",
            "n: {ros__parameters: {x: !!bool foo}}\n",
        ),
        (
            "Node(package='p', executable='e', name='n', parameters=['p.yaml'])",
            f"n: {{ros__parameters: {{x: 0x{'f' * 5000}}}}}\n",
        ),
        (
            "Node(package='p', condition=IfCondition(EqualsSubstitution(left='a', right='b')))",
            "",
        ),
        ("LaunchDescription([LaunchDescription([Node(package='p', executable='e', name='n')])])", ""),
        ("(lambda a: [a.append(a), Node(package=a, executable='e')])(['x'])", ""),
        ("(lambda a: OnProcessExit(on_exit=[a.append(a), a]))([])", ""),
        ("Node(package='p', executable='e', name=f\"{[['x'] * 2] * 2:}\")", ""),
        ("GroupAction([], launch_configurations=[(['a'], 'b')])", ""),
        ("Node(package='p', executable='e', parameters=[{LaunchConfiguration('x', default=['a']): 1}])", ""),
    ],
)
def test_odd_values_end_in_a_draft(body: str, params: str, tmp_path: Path) -> None:
    known = "Node(package='p', executable='known', name='known')"
    made = draft(lab(tmp_path, {"a.launch.py": launch(known, body), "p.yaml": params}))
    assert "known" in data(made)["programs"]


def test_numbers_are_those_of_rcl(tmp_path: Path) -> None:
    file = "node: {ros__parameters: {a: 1e-3, b: [1e-3, 2.0]}}\n"
    node = "Node(package='p', executable='e', name='node', parameters=['p.yaml', dict(c=True)])"
    made = draft(lab(tmp_path, {"a.launch.py": launch(node), "p.yaml": file}))
    assert data(made)["programs"]["node"]["params"] == {"a": 0.001, "b": [0.001, 2.0], "c": True}
