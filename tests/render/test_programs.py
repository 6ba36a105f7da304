"""Programs in a release: the exact bytes of one of each kind, and what their readers make of them."""

from __future__ import annotations

import shlex
import shutil
import subprocess
import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from swarm_onboard.teleop import config as teleop_config

from swarmctl.cli.app import run
from swarmctl.health.unit_faults import waits_for_trial
from swarmctl.render.build_bundle import bundles
from swarmctl.render.bundle import Bundle, File, Unit
from swarmctl.render.quoting import render
from tests import ROOT
from tests.loading import load_swarm

SPEC = Path(__file__).with_name("programs.yaml")
GOLDEN = Path(__file__).parent / "golden/programs"
SET_TWICE = ROOT / "tests/rules/doubtful/packages/PKG023-namespace-twice.yaml"
PROGRAMS = (
    "joystick", "keys", "wander", "map", "record", "seeing", "set-up", "calibrate", "drive", "arm",
)  # fmt: skip

ANY_CHARACTER = st.characters(exclude_categories=["Cc", "Cs", "Zl", "Zp"], exclude_characters="\ufffe\uffff")
UNIT_VALUES = {
    "swarm": "s", "program": "p", "home": "/opt/swarm/s", "target": "t", "runtime": "r", "packages": (),
    "user": "robot", "shipped": False, "container": "", "engine": "", "lifecycle": "service", "secrets": (),
    "memory_mb": None, "master": True, "ends_together": False, "enclave": "",
}  # fmt: skip
LAUNCH_VALUES = {
    "home": "/opt/swarm/s", "program": "p", "group": "", "node": "p", "package": "a", "executable": "b",
    "launch": None, "loaded": [], "arguments": [], "remap": [], "environment": [],
    "own": "", "by_hand": [],
}  # fmt: skip


def rendered_of(spec: Path) -> Mapping[str, Bundle]:
    swarm, found = load_swarm(spec)
    assert swarm is not None, found
    return bundles(swarm)


@pytest.fixture(scope="module")
def rendered() -> Mapping[str, Bundle]:
    return rendered_of(SPEC)


def files_of(bundle: Bundle) -> dict[str, File]:
    return {file.path: file for file in bundle.files}


def unit_of(bundle: Bundle, program: str) -> Unit:
    return next(unit for unit in bundle.units if unit.program == program)


def parts(file: File) -> set[str]:
    """The words of a file's name: `units/swarm-prog.map.service` is of `map`."""
    return set(Path(file.path).name.split("."))


def test_golden(
    rendered: Mapping[str, Bundle], golden: Callable[[Path, str], None], regenerating: bool
) -> None:
    if regenerating:
        shutil.rmtree(GOLDEN, ignore_errors=True)
    expected = set()
    for host, bundle in rendered.items():
        for file in bundle.files:
            if parts(file) & set(PROGRAMS) and not file.path.startswith("teleop/"):
                golden(GOLDEN / host / file.path, file.content.decode())
                expected.add(f"{host}/{file.path}")
    assert {str(one.relative_to(GOLDEN)) for one in GOLDEN.rglob("*") if one.is_file()} == expected


def test_a_host_gets_only_what_its_own_programs_need(rendered: Mapping[str, Bundle]) -> None:
    laptop, pi = (set(files_of(rendered[host])) for host in ("laptop", "pi"))
    assert {"bin/ros-client", "bin/has-packages", "bin/keys", "teleop/teleop_key.py"} <= laptop
    assert "bin/ros-client" in pi
    assert not any(path.startswith("teleop/") or path == "bin/has-packages" for path in pi)


def test_an_interactive_program_has_a_script_and_no_unit(
    rendered: Mapping[str, Bundle],
) -> None:
    laptop = rendered["laptop"]
    assert not [unit for unit in laptop.units if unit.program == "keys"]
    command = files_of(laptop)["bin/keys"]
    assert command.mode == 0o755
    subprocess.run(["bash", "-n"], input=command.content, check=True)


def test_a_joystick_that_commands_nobody_has_no_unit_to_fail(tmp_path: Path) -> None:
    text = SPEC.read_text("utf-8")
    (tmp_path / "swarm.yaml").write_text(text[: text.index("control:")], "utf-8")
    made = rendered_of(tmp_path / "swarm.yaml")
    assert "joystick" not in {unit.program for bundle in made.values() for unit in bundle.units}


def test_a_shipped_program_reads_its_node_and_its_topics(
    rendered: Mapping[str, Bundle],
) -> None:
    params = yaml.safe_load(files_of(rendered["laptop"])["params/joystick.yaml"].content)
    assert params["node"] == "/joystick"
    assert params["targets"] == [
        {"robot": "koala", "topic": "/koala/cmd_vel"},
        {"robot": "k-3", "topic": "/k_3/cmd_vel"},
    ]
    assert params["params"] == {"device": "/dev/input/js0"}


def test_the_shipped_programs_read_their_own_parameters(
    rendered: Mapping[str, Bundle], tmp_path: Path
) -> None:
    for program, kind in (("joystick", "teleop-joy"), ("keys", "teleop-key")):
        path = tmp_path / f"{program}.yaml"
        path.write_bytes(files_of(rendered["laptop"])[f"params/{program}.yaml"].content)
        config = teleop_config.load(path, kind)
        assert config.node == f"/{program}"
        assert config.robots == ("koala", "k-3")


def test_parameters_keep_type_and_text(rendered: Mapping[str, Bundle]) -> None:
    params = yaml.safe_load(files_of(rendered["pi"])["params/wander.yaml"].content)
    assert params == {
        "speed": 0.1, "small": 1e-05, "on": True, "text": "deg(90) $(reboot)", "id": "007", "gain/p": 2,
        "frames": {"odom": ["k_3/odom", "{x}"]},
    }  # fmt: skip
    assert [type(value) for value in params.values()][:6] == [float, float, bool, str, str, int]


def test_launch_files_put_a_node_into_its_robots_namespace(rendered: Mapping[str, Bundle]) -> None:
    (group,) = ET.fromstring(files_of(rendered["pi"])["launch/wander.launch"].content).findall("group")
    node = group.find("node")
    assert group.get("ns") == "k_3"
    assert node is not None
    assert (node.get("pkg"), node.get("type"), node.get("name")) == ("wander", "wander.py", "wander")
    assert {one.get("name"): one.get("value") for one in group.iter("env")} == {
        "LANG": "C.UTF-8", "NOTE": 'a "b" & c', "WHO": "k-3 on pi, {so}"
    }  # fmt: skip


def test_a_node_gets_the_words_of_its_command_line(rendered: Mapping[str, Bundle]) -> None:
    (node,) = ET.fromstring(files_of(rendered["pi"])["launch/wander.launch"].content).iter("node")
    assert shlex.split(node.get("args", "")) == ["--name", "a 'b' & \"c\"", "x:=1", ""]


def test_words_reach_a_command_as_they_stand(rendered: Mapping[str, Bundle]) -> None:
    unit = files_of(rendered["laptop"])["units/swarm-prog.record.service"].content.decode()
    assert words_of_unit(unit)[-7:] == [
        "rosbag", "record", "-a", "-O", "/var/bags/laptop of prog.bag", "--duration=100%", "$HOME{}"
    ]  # fmt: skip


def words_of_unit(unit: str) -> list[str]:
    """What systemd makes of ExecStart (systemd.service(5)): it unquotes, and `%%` and `$$` are one."""
    (line,) = (one for one in unit.splitlines() if one.startswith("ExecStart="))
    return [one.replace("%%", "%").replace("$$", "$") for one in shlex.split(line.partition("=")[2])]


@settings(deadline=None, max_examples=60)
@given(words=st.lists(st.text(ANY_CHARACTER), min_size=1))
def test_any_word_survives_the_unit_and_the_launch_file(words: list[str]) -> None:
    unit = render("program.service", **UNIT_VALUES, command=words).decode()
    assert words_of_unit(unit)[-len(words) :] == words
    launch = [one for one in words if "$(" not in one]
    node = ET.fromstring(render("program.launch", **LAUNCH_VALUES, words=shlex.join(launch))).find(".//node")
    assert node is not None
    assert shlex.split(node.get("args", "")) == launch


def test_a_container_runs_by_its_digest_on_the_hosts_network(rendered: Mapping[str, Bundle]) -> None:
    laptop = rendered["laptop"]
    words = words_of_unit(files_of(laptop)["units/swarm-prog.seeing.service"].content.decode())
    options, image = words[words.index("run") + 1 :], next(one for one in words if "@sha256:" in one)
    assert options[options.index("--network") + 1] == "host"
    assert options[options.index("--device") + 1] == "/dev/video0"
    assert options[options.index("--stop-signal") + 1] == "SIGINT"
    assert words[words.index(image) + 1 :] == ["rosrun", "seeing", "see", "--robot=koala"]
    assert {"LANG=C.UTF-8", "ROS_NAMESPACE=/koala"} <= set(words)
    assert "podman" in laptop.requires


def test_a_container_of_podman_belongs_to_its_unit(rendered: Mapping[str, Bundle]) -> None:
    unit = files_of(rendered["laptop"])["units/swarm-prog.seeing.service"].content.decode()
    words = words_of_unit(unit)
    assert words[words.index("--cgroups") + 1] == "split"
    assert "Delegate=yes\n" in unit
    assert "MemoryMax=1128M\n" in unit
    assert "--memory" not in words


def test_a_container_of_docker_has_its_limits_from_the_daemon(tmp_path: Path) -> None:
    text = SPEC.read_text("utf-8").replace("container:\n", "container:\n      engine: docker\n")
    (tmp_path / "swarm.yaml").write_text(text, "utf-8")
    laptop = rendered_of(tmp_path / "swarm.yaml")["laptop"]
    unit = files_of(laptop)["units/swarm-prog.seeing.service"].content.decode()
    words = words_of_unit(unit)
    assert words[words.index("--memory") + 1] == "1000m"
    assert "--cgroups" not in words
    assert "MemoryMax=" not in unit
    assert "Delegate=" not in unit


def test_a_oneshot_ends_and_stays_started(rendered: Mapping[str, Bundle]) -> None:
    unit = files_of(rendered["pi"])["units/swarm-prog.set-up.service"].content.decode()
    assert "RemainAfterExit=yes" in unit
    assert "--forever" not in unit
    assert "Restart=on-failure" not in unit


def test_a_program_of_trials_waits_for_one_and_is_not_restarted(tmp_path: Path) -> None:
    text = SPEC.read_text("utf-8").replace(
        "calibrate: {robot: k-3, lifecycle: oneshot", "calibrate: {robot: k-3, lifecycle: trial"
    )
    (tmp_path / "swarm.yaml").write_text(text, "utf-8")
    name = "swarm-prog.calibrate.service"
    unit = files_of(rendered_of(tmp_path / "swarm.yaml")["pi"])[f"units/{name}"].content.decode()
    (condition,) = (line for line in unit.splitlines() if line.startswith("Condition"))
    assert waits_for_trial(name, [condition])
    assert "Restart=no\n" in unit
    assert "RemainAfterExit" not in unit
    assert "bin/restart-delay" not in unit


def test_a_namespace_of_its_own_comes_before_the_robots(rendered: Mapping[str, Bundle]) -> None:
    (group,) = ET.fromstring(files_of(rendered["pi"])["launch/arm.launch"].content).findall("group")
    assert group.get("ns") == "k_3/arm"
    assert {one.get("name"): one.get("value") for one in group.iter("arg")} == {
        "prefix": "k_3/arm/", "name": "{k}"
    }  # fmt: skip


def test_a_launch_file_that_takes_its_namespace_has_none_around_it(tmp_path: Path) -> None:
    text = SPEC.read_text("utf-8").replace("arm.launch, ", "arm.launch, namespace_argument: ns, ")
    (tmp_path / "swarm.yaml").write_text(text, "utf-8")
    launched = files_of(rendered_of(tmp_path / "swarm.yaml")["pi"])["launch/arm.launch"].content
    (group,) = ET.fromstring(launched).findall("group")
    assert group.get("ns") is None
    assert {one.get("name"): one.get("value") for one in group.iter("arg")} == {
        "ns": "k_3/arm", "prefix": "k_3/arm/", "name": "{k}"
    }  # fmt: skip


@pytest.mark.parametrize("robots", ["robot: tb-1", "robots: [tb-1]"])
def test_the_fix_of_a_namespace_set_twice_leaves_one_of_ros_2(robots: str, tmp_path: Path) -> None:
    spec = tmp_path / "swarm.yaml"
    spec.write_text(SET_TWICE.read_text("utf-8").replace("robot: tb-1", robots), "utf-8")
    assert run(["validate", "--fix", str(spec)]) == 0
    files = files_of(rendered_of(spec)["r1"])
    (launched,) = (one.content for path, one in files.items() if path.startswith("launch/nav"))
    root = ET.fromstring(launched)
    assert [*root.iter("push_ros_namespace")] == []
    assert {one.get("name"): one.get("value") for one in root.iter("arg")} == {
        "namespace": "tb_1", "use_namespace": "True"
    }  # fmt: skip


def test_a_launch_file_gets_arguments(rendered: Mapping[str, Bundle]) -> None:
    (include,) = ET.fromstring(files_of(rendered["laptop"])["launch/map.launch"].content).iter("include")
    assert include.get("file") == "$(find gmapping)/launch/map.launch"
    assert {one.get("name"): one.get("value") for one in include} == {
        "delta": "0.05", "frame": "map & more", "deep": "true", "name": "laptop"
    }  # fmt: skip


def test_optional_packages_are_looked_up_but_not_required(rendered: Mapping[str, Bundle]) -> None:
    laptop, pi = rendered["laptop"], rendered["pi"]
    assert unit_of(laptop, "map").packages == ("gmapping", "tf")
    assert not {"package:gmapping", "package:tf"} & set(laptop.requires)
    assert {"package:gmapping", "package:tf"} <= set(laptop.asks)
    assert "package:wander" in pi.requires


def test_a_changed_parameter_restarts_its_program_alone(
    rendered: Mapping[str, Bundle], tmp_path: Path
) -> None:
    spec = tmp_path / "swarm.yaml"
    spec.write_text(SPEC.read_text("utf-8").replace("speed: 0.1", "speed: 0.2"), "utf-8")
    before, after = (one["pi"].manifest["units"] for one in (rendered, rendered_of(spec)))
    changed = [one["name"] for one, other in zip(before, after, strict=True) if one != other]
    assert changed == ["swarm-prog.wander.service"]


def test_every_need_is_a_file_of_the_bundle(rendered: Mapping[str, Bundle]) -> None:
    for bundle in rendered.values():
        assert len(files_of(bundle)) == len(bundle.files)
        assert {path for unit in bundle.units for path in unit.needs} <= set(files_of(bundle))


def test_a_program_runs_on_the_first_host_with_its_needs(tmp_path: Path) -> None:
    spec = tmp_path / "swarm.yaml"
    text = SPEC.read_text("utf-8").replace("map:\n    host: laptop", "map:\n    needs: [kinect, gpu]")
    text = text.replace("user: root}", "user: root, has: [gpu, kinect]}")
    spec.write_text(text.replace("user: robot}", "user: robot, has: [kinect]}"), "utf-8")
    on = {host: [unit.program for unit in bundle.units] for host, bundle in rendered_of(spec).items()}
    assert "map" in on["pi"]
    assert "map" not in on["laptop"]
