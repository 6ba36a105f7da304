"""``swarmctl init``: a start that is right as it stands, and never a file lost."""

from __future__ import annotations

import json
from collections.abc import Iterable
from itertools import combinations
from pathlib import Path

import pytest
import yaml

from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from swarmctl.linter.runner import lint
from swarmctl.plugins import MIDDLEWARES
from swarmctl.robot_types.any_robot_type import AnyRobotType
from swarmctl.robot_types.ros_robot_type import RosRobotType
from swarmctl.scaffold.starting_files import starting_spec
from swarmctl.spec.catalog import load_catalog
from swarmctl.spec.load import load_text
from swarmctl.spec.model import Mode
from tests.loading import load_swarm
from tests.schema.validator import valid
from tests.sizes import some_of

PLACEHOLDER = "LINK013"


def exists(kind: AnyRobotType, distro: str) -> bool:
    """True if robots of this type have a driver for ROS of this distribution."""
    return not isinstance(kind, RosRobotType) or any(one.is_for(distro) for one in kind.drivers)


CATALOG = load_catalog()
#: One type, and each two that a distribution has drivers of.
CHOICES = [
    chosen
    for size in (1, 2)
    for chosen in combinations(sorted(CATALOG.types), size)
    if any(all(exists(CATALOG.types[one], distro) for one in chosen) for distro in MIDDLEWARES)
]


@pytest.mark.parametrize("first", sorted(CATALOG.types))
@pytest.mark.parametrize("mode", some_of(Mode, [Mode.LEADER, Mode.COMBINED]), ids=lambda mode: mode.value)
def test_only_placeholders_are_found_in_every_mode(mode: Mode, first: str) -> None:
    for types in CHOICES:
        if types[0] != first:
            continue
        named = {name.replace(".", "-"): name for name in types}
        robots = named | {f"{robot}-2": name for robot, name in named.items()}
        text = starting_spec("lab", mode, robots, CATALOG.types)
        document, found = load_text(text, "swarm.yaml", CATALOG)
        assert found == (), types
        assert document is not None
        expected = {PLACEHOLDER, *_shared_by(types, mode)}
        if document.spec.ros.distro != MIDDLEWARES.default and mode in (Mode.STANDALONE, Mode.COMBINED):
            expected.add("MODE017")
        assert {one.code for one in lint(document)} <= expected, types
        assert valid("swarm", json.loads(json.dumps(document.source.data))), types
        assert list(document.spec.robots) == list(robots)


def _shared_by(types: Iterable[str], mode: Mode) -> set[str]:
    """What two robots of types share whose launch file fixes their devices (an error) or frames."""
    frames = {"DRIVER003"} if "kobuki" in types else set()
    fixed = any(name.startswith(("kobuki", "turtlebot3")) for name in types)
    return frames | ({"ID002"} if fixed and mode is Mode.SINGLE_MINDED else set())


def test_robots_with_one_device_on_one_host_are_an_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    flags = ["--mode", "single-minded", "--robot", "tb3-[1-2]=turtlebot3-burger"]
    assert run(["init", str(tmp_path), *flags]) == exit_codes.ERROR
    assert "robot `tb3-1` and robot `tb3-2` open one device of host `laptop`" in capsys.readouterr().err
    assert not (tmp_path / "swarm.yaml").exists()


def test_it_writes_a_spec_and_its_schemas(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["init", str(tmp_path / "My swarm")]) == exit_codes.OK
    swarm, found = load_swarm(tmp_path / "My swarm/swarm.yaml")
    assert {one.code for one in found} == {PLACEHOLDER}
    assert (swarm and swarm.name, swarm and swarm.mode) == ("my-swarm", Mode.LEADER)
    assert {file.name for file in (tmp_path / "My swarm").iterdir()} == {"swarm.yaml", ".swarmctl"}
    assert str(tmp_path / "My swarm/swarm.yaml") in capsys.readouterr().out


def test_the_modelines_lead_to_the_schema(tmp_path: Path, root: Path) -> None:
    run(["init", str(tmp_path)])
    first, second, *_ = (tmp_path / "swarm.yaml").read_text("utf-8").splitlines()
    assert first == "# yaml-language-server: $schema=.swarmctl/swarm.schema.json"
    assert second == "# $schema: .swarmctl/swarm.schema.json"
    for name in ("swarm", "robot-type"):
        file = f"{name}.schema.json"
        assert (tmp_path / ".swarmctl" / file).read_bytes() == (root / "schemas" / file).read_bytes()


@pytest.mark.parametrize("mode", list(Mode), ids=lambda mode: mode.value)
def test_a_range_stays_one_entry(mode: Mode, tmp_path: Path) -> None:
    """Its hosts, addresses and lines become ranges as well; robots by Bluetooth in between count on."""
    robots = ["k3-[1-3]=khepera3", "one=koala", "epuck-[1-3]=epuck", "p3-[01-12]=pioneer3"]
    flags = [word for robot in robots for word in ("--robot", robot)]
    assert run(["init", str(tmp_path), "--mode", mode.value, *flags]) == exit_codes.OK
    swarm, found = load_swarm(tmp_path / "swarm.yaml")
    assert [one.code for one in found] == [PLACEHOLDER] * 2  # adapters, Bluetooth addresses
    assert swarm is not None
    assert len(swarm.robots) == 3 + 1 + 3 + 12
    written = (tmp_path / "swarm.yaml").read_text("utf-8")
    assert [written.count(f"{robot}: {{type") for robot in ('"k3-[1-3]"', "one", '"p3-[01-12]"')] == [
        1,
        1,
        1,
    ]
    spec = yaml.safe_load(written)
    assert len(spec["robots"]) == len(robots)
    assert [link["mac"] for link in spec["links"] if "mac" in link] == ["02:00:00:00:00:[05-07]"]


def test_flags_say_what_is_in_it(tmp_path: Path) -> None:
    flags = ["--name", "hall", "--mode", "central", "--robot", "a=koala", "--robot", "b=epuck"]
    assert run(["init", str(tmp_path), *flags]) == exit_codes.OK
    swarm, _ = load_swarm(tmp_path / "swarm.yaml")
    assert swarm is not None
    assert (swarm.name, swarm.mode) == ("hall", Mode.CENTRAL)
    assert {name: robot.type_name for name, robot in swarm.robots.items()} == {"a": "koala", "b": "epuck"}


def test_the_help_names_every_mode(capsys: pytest.CaptureFixture[str]) -> None:
    run(["init", "--help"])
    output = capsys.readouterr().out
    assert [mode.value for mode in Mode if mode.value not in output] == []


def test_robot_types_beside_the_spec_count(tmp_path: Path, root: Path) -> None:
    (tmp_path / "robots").mkdir()
    (tmp_path / "robots/rover.yaml").write_bytes((root / "templates/robots/koala.yaml").read_bytes())
    assert run(["init", str(tmp_path), "--robot", "r=rover"]) == exit_codes.OK
    assert {one.code for one in load_swarm(tmp_path / "swarm.yaml")[1]} == {PLACEHOLDER}


@pytest.mark.parametrize("taken", ["swarm.yaml", ".swarmctl/robot-type.schema.json"])
def test_it_never_writes_over_a_file(taken: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / taken).parent.mkdir(exist_ok=True)
    (tmp_path / taken).write_text("mine\n")
    assert run(["init", str(tmp_path)]) == exit_codes.ERROR
    output = capsys.readouterr().err
    assert f"{tmp_path / taken} exists already" in output
    assert "help: " in output
    assert [one.read_text() for one in tmp_path.rglob("*") if one.is_file()] == ["mine\n"]


def test_twice_is_once(tmp_path: Path) -> None:
    assert [run(["init", str(tmp_path)]) for _ in range(2)] == [exit_codes.OK, exit_codes.OK]


@pytest.mark.parametrize(
    ("flags", "code", "expected"),
    [
        (["--mode", "leadr"], exit_codes.USAGE, "did you mean `leader`?"),
        (["--robot", "k3"], exit_codes.USAGE, "write NAME=TYPE, like k3=khepera3"),
        (["--robot", "k3=kepera3"], exit_codes.USAGE, "did you mean `khepera3`?"),
        (["--robot", "a=koala", "--robot", "a=epuck"], exit_codes.USAGE, "two robots are called `a`"),
        (["--robot", "K3=khepera3"], exit_codes.ERROR, "names are lower-case letters"),
        (["--name", "Hall 2"], exit_codes.ERROR, "names are lower-case letters"),
    ],
)
def test_invalid_options_are_errors_and_nothing_is_written(
    flags: list[str], code: int, expected: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["init", str(tmp_path / "new"), *flags]) == code
    assert expected in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_is_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "new").write_text("")
    assert run(["init", str(tmp_path / "new")]) == exit_codes.ERROR
    assert "cannot write" in capsys.readouterr().err


def test_schemas_are_refreshed_by_schema_out(tmp_path: Path, root: Path) -> None:
    run(["init", str(tmp_path)])
    (tmp_path / ".swarmctl/swarm.schema.json").write_text("{}")
    assert run(["schema", "--out", str(tmp_path / ".swarmctl")]) == exit_codes.OK
    fresh = (tmp_path / ".swarmctl/swarm.schema.json").read_bytes()
    assert fresh == (root / "schemas/swarm.schema.json").read_bytes()


def test_the_name_keeps_the_digits_of_the_folder(tmp_path: Path) -> None:
    assert run(["init", str(tmp_path / "2024 lab")]) == exit_codes.OK
    swarm, _ = load_swarm(tmp_path / "2024 lab/swarm.yaml")
    assert swarm is not None
    assert swarm.name == "swarm-2024-lab"
