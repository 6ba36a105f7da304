"""``swarmctl driver new``: a commented file that names what to fill in, and never overwrites another."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from swarmctl.diagnostics import Diagnostic
from swarmctl.spec.catalog import load_catalog

GOLDEN = Path(__file__).parent / "golden/driver-new"
WHEELS = {"wheel_separation": "0.08", "wheel_speed_max": "0.25"}
SCALES = {"speed_units_per_mps": "1000.0", "metres_per_count": "1.0e-5"}
FILLED = {
    "line": {**WHEELS, **SCALES, "send": '"S,{left},{right}"', "reply": "s"},
    "binary": {**WHEELS, **SCALES, "send": '"bc {left:h} {right:h}"'},
    "python": {**WHEELS, **SCALES},
    "rosserial": {**WHEELS, "firmware_timeout": "0.4"},
}
_EMPTY = re.compile(r"^([ -]*)([a-z_]+):(?=(?:  #.*)?$)(?!  # (?:sets|the robot's))", re.MULTILINE)
_EXAMPLE = re.compile(r"^( *)# (?= *(?:[a-z_]+:|- \{))", re.MULTILINE)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def written(protocol: str) -> Path:
    """The new file of the type ``ant``."""
    assert run(["driver", "new", "ant", "--protocol", protocol]) == exit_codes.OK
    return Path("robots/ant.yaml")


def filled(text: str, protocol: str) -> str:
    """``text`` with a value for each key that has none."""
    values = FILLED[protocol]
    return _EMPTY.sub(lambda key: f"{key[0]} {values[key[2]]}" if key[2] in values else key[0], text)


def found_in(text: str) -> tuple[Diagnostic, ...]:
    Path("robots/ant.yaml").write_text(text)
    return load_catalog(Path("robots")).diagnostics


@pytest.mark.parametrize("protocol", FILLED)
def test_the_file_names_what_to_fill_in(protocol: str, golden: Callable[[Path, str], None]) -> None:
    text = written(protocol).read_text()
    golden(GOLDEN / f"{protocol}.yaml", text)
    found = load_catalog(Path("robots")).diagnostics
    lines = text.splitlines()
    places = [lines[one.span.line - 1].strip(" -").partition(":")[0] for one in found if one.span]
    assert places == list(FILLED[protocol])
    assert all("is empty; it must be" in one.message and one.help for one in found)


@pytest.mark.parametrize("protocol", FILLED)
def test_the_file_is_valid_once_filled_in(protocol: str) -> None:
    file = written(protocol)
    file.write_text(filled(file.read_text(), protocol))
    catalog = load_catalog(Path("robots"))
    assert catalog.diagnostics == ()
    made = catalog.types["ant"]
    assert (made.title, made.kinematics.wheel_separation, made.protocol.kind) == ("Ant", 0.08, protocol)
    assert [one.metres_per_count for one in made.kinematics.scales] == [1e-5] * (protocol != "rosserial")
    assert (file.with_suffix(".py").exists(), "ant" in catalog.codecs) == (protocol == "python",) * 2


@pytest.mark.parametrize("protocol", FILLED)
def test_every_example_is_valid_without_its_hash(protocol: str) -> None:
    file = written(protocol)
    file.write_text(_EXAMPLE.sub(r"\1", filled(file.read_text(), protocol)))
    catalog = load_catalog(Path("robots"))
    assert catalog.diagnostics == ()
    made = catalog.types["ant"]
    if made.sketch is not None:
        assert made.sketch.odometry is not None
    else:
        assert {one.kind for one in made.sensors.values()} == {"wheels", "raw", "range", "battery"}
        assert made.actuators["lamp"].channels == ("lamp",)


@pytest.mark.parametrize(
    ("protocol", "right", "wrong", "message"),
    [
        ("line", "baud: 115200", "baud: fast", "`baud` must be a whole number, not `fast`"),
        ("line", "baud: 115200", "baud: 12", "`baud` cannot be `12`"),
        ("line", "speed_max: 0.25", "speed_max: .inf", "`wheel_speed_max` cannot be `inf`"),
        ("line", "speed_max: 0.25", "speed_max: 80 mm", "`80 mm` is a length, and this is a speed"),
        ("line", "S,{left},{right}", "S,{left}", "needs {left} and {right}, once each"),
        ("line", "title: Ant", 'title: "a\\nb"', "`title` cannot be `a\\nb`"),
        ("line", "kinds: [serial]", "kinds: [usb]", "cannot be `usb`"),
        ("line", "kind: line", "kind: morse", "`morse` is not a kind of protocol"),
        ("line", "dead_man: false", "dead_man: perhaps", "must be true or false, not `perhaps`"),
        ("line", 'terminator: "\\r"', "terminator: crlf", "`terminator` cannot be `crlf`"),
        ("binary", "bc {left:h} {right:h}", "bc {left:h}", "needs {left:h} and {right:h}, once each"),
        ("line", "kind: raw", "kind: colour", "`colour` is not a kind of sensor"),
        ("line", "  floor: {kind", "  Floor: {kind", "cannot be `Floor`"),
        ("line", "  eyes: {send", "  floor: {send", "the key `floor` is here twice"),
        ("line", "heading_deg: 20.0", "heading_deg: ahead", "`heading_deg` must be a number, not `ahead`"),
        ("line", "[10.0, 0.3]", "[0.3]", "has too few entries"),
        ("line", ", [255.0, 0.0]]", "]", "has too few entries"),
        ("line", "empty: 3.4", "empty: 5", "`empty` must be below `full`"),
        ("line", "channels: [lamp]", "channels: [a, b]", "needs {value}, and {index}"),
        ("binary", 'send: "66", reply: 2B', 'send: "66", reply: 1B', "has 1 values, sensor `floor` takes 2"),
        ("python", "floor: {values: 2", "floor: {send: F, values: 2", "unknown key `send`"),
        ("binary", "set_speed:", "identity: {send: V}\n  set_speed:", "unknown key `identity`"),
    ],
)
def test_a_wrong_value_is_an_error_that_names_it(protocol: str, right: str, wrong: str, message: str) -> None:
    text = _EXAMPLE.sub(r"\1", filled(written(protocol).read_text(), protocol))
    assert text.count(right) >= 1
    found = found_in(text.replace(right, wrong, 1))
    assert message in "\n".join(one.message for one in found)


def test_the_new_codec_handles_lines_of_text() -> None:
    """The skeleton is a complete codec: numbers in, bytes out, and back."""
    from swarm_onboard.driver.protocols import PythonProtocol
    from swarm_onboard.driver.user_codec import UserCodec

    file = written("python").with_suffix(".py").resolve()
    protocol = PythonProtocol(0.2, file, "AntCodec", {}, True, {"position": 2})
    codec = UserCodec(protocol)
    assert codec.speed(-5, 7).data == b"S,-5,7\r"
    reader = codec.query("position").reader()
    assert reader.feed(b"noise\r\np,1") is None
    reply = reader.feed(b"2,-3\r\n")
    assert (reply and reply.values, reader.noise) == ((12, -3), 1)


def test_the_new_codec_knows_every_example_query() -> None:
    from swarm_onboard.driver.protocols import PythonProtocol
    from swarm_onboard.driver.user_codec import UserCodec

    file = written("python")
    file.write_text(_EXAMPLE.sub(r"\1", filled(file.read_text(), "python")))
    made = load_catalog(Path("robots")).types["ant"]
    assert made.driver_protocol is not None
    counts = {name: query.values for name, query in made.driver_protocol.queries.items()}
    codec = UserCodec(PythonProtocol(0.2, file.with_suffix(".py").resolve(), "AntCodec", {}, True, counts))
    assert [codec.query(name).data for name in counts] == [b"P\r", b"F\r", b"E\r", b"V\r"]


def test_editors_find_the_schema_that_init_wrote(folder: Path) -> None:
    (folder / ".swarmctl").mkdir()
    assert written("line").read_text().startswith("# yaml-language-server: $schema=../.swarmctl/")


def test_a_folder_that_cannot_be_written_is_an_error(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "file").touch()
    for place, why in (("x" * 300, "file name too long"), ("file", "not a directory")):
        assert run(["driver", "new", "snail", "--dir", place]) == exit_codes.ERROR
        printed = capsys.readouterr().err.lower()
        assert f"cannot write {place}" in printed.replace("\n", " ")
        assert why in printed.replace("\n", " ")
        assert "choose another --dir" in printed


def test_no_file_is_overwritten(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["driver", "new", "snail", "--protocol", "python"]) == exit_codes.OK
    (folder / "robots/snail.py").write_text("mine")
    before = (folder / "robots/snail.yaml").read_text()
    assert run(["driver", "new", "snail"]) == exit_codes.ERROR
    assert (folder / "robots/snail.yaml").read_text() == before
    (folder / "robots/snail.yaml").unlink()
    assert run(["driver", "new", "snail"]) == exit_codes.ERROR
    assert "robots/snail.py exists already" in capsys.readouterr().err
    assert [(one.name, one.read_text()) for one in (folder / "robots").iterdir()] == [("snail.py", "mine")]


@pytest.mark.parametrize(
    ("driver", "kind", "file"),
    [
        ("ant_base/ant_node.py", "executable", "ant_node.py"),
        ("ant_base/launch/base.launch", "launch", "base.launch"),
    ],
)
def test_a_driver_that_exists_is_named_with_its_package(
    driver: str, kind: str, file: str, golden: Callable[[Path, str], None]
) -> None:
    assert run(["driver", "new", "ant", "--driver", driver]) == exit_codes.OK
    text = Path("robots/ant.yaml").read_text()
    golden(GOLDEN / f"ros-{kind}.yaml", text)
    found = found_in(text)
    assert {one.message for one in found if one.code == "YAML015"} == {
        f"`{key}` has no value" for key in ("wheel_separation", "linear_max", "angular_max")
    }
    values = {"wheel_separation": "0.2", "linear_max": "0.3", "angular_max": "2.0"}
    filled_in = _EMPTY.sub(lambda key: f"{key[0]} {values[key[2]]}" if key[2] in values else key[0], text)
    assert found_in(filled_in) == ()
    assert found_in(_EXAMPLE.sub(r"\1", filled_in)) == ()
    made = load_catalog(Path("robots")).types["ant"].driver
    assert made is not None
    assert (made.package, getattr(made, kind), made.publishes[0].rate) == ("ant_base", file, 10.0)


@pytest.mark.parametrize("driver", ["ant_base", "ant base/x", "/x", "ant_base/", "ant_base/../x", "a/b\nc"])
def test_a_driver_that_is_no_file_of_a_package_is_an_error(
    driver: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["driver", "new", "ant", "--driver", driver]) == exit_codes.USAGE
    assert "does not name a file of a ROS package" in capsys.readouterr().err
    assert run(["driver", "new", "ant", "--driver", "a/b", "--protocol", "line"]) == exit_codes.USAGE
    assert not (folder / "robots").exists()


def test_an_unknown_protocol_is_an_error(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["driver", "new", "ant", "--protocol", "morse"]) == exit_codes.USAGE
    printed = capsys.readouterr().err
    assert "there is no protocol kind `morse`" in printed
    assert "`binary`, `line`, `python`, `rosserial`" in printed
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize("name", ["Ant", "../ant", "ant beetle", "1ant", "", "ant\n"])
def test_a_bad_type_name_is_an_error(name: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["driver", "new", name]) == exit_codes.USAGE
    assert "cannot be the name of a robot type" in capsys.readouterr().err
    assert list(folder.iterdir()) == []
