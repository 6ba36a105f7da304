"""What a person sees in an editor, read from the YAML language server that VS Code and Neovim run."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from pydantic import BaseModel

from swarmctl.cli.app import run
from swarmctl.links.bluetooth_link import Bluetooth
from swarmctl.links.serial_link import Serial
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.ros_robot_type import RosRobotType
from swarmctl.spec.model import Host, Robot, RobotSettings, Spec
from swarmctl.spec.program_model import Program
from tests.editors.language_server import LanguageServer, running

CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "swarmctl/editor-tools"
SPEC = "# yaml-language-server: $schema=.swarmctl/swarm.schema.json\n"
ROBOT_TYPE = "# yaml-language-server: $schema=.swarmctl/robot-type.schema.json\n"


def installed() -> str | None:
    """The server: where the environment says, where `make editor-tools` puts it, or on the PATH."""
    named = os.environ.get("YAML_LANGUAGE_SERVER")
    return named or shutil.which(
        "yaml-language-server", path=f"{CACHE}/node_modules/.bin:{os.environ['PATH']}"
    )


@pytest.fixture(scope="module")
def swarm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder as `swarmctl init` leaves it."""
    folder = tmp_path_factory.mktemp("swarm")
    assert run(["init", str(folder)]) == 0
    return folder


@pytest.fixture(scope="module")
def server() -> Path:
    server = installed()
    if server is None or shutil.which("node") is None:
        pytest.skip("no yaml-language-server here: make editor-tools installs it where npm is")
    return Path(server)


@pytest.fixture(scope="module")
def editor(server: Path, swarm: Path) -> Iterator[LanguageServer]:
    with running(server, swarm) as editor:
        yield editor


def marked(editor: LanguageServer, text: str) -> list[str]:
    """The stretches of a text that the editor underlines."""
    lines = text.splitlines()
    ranges = [found["range"] for found in editor.diagnostics(text)]
    return [
        lines[one["start"]["line"]][one["start"]["character"] : one["end"]["character"]] for one in ranges
    ]


def test_nothing_is_marked_in_a_first_spec(editor: LanguageServer, swarm: Path) -> None:
    assert editor.diagnostics((swarm / "swarm.yaml").read_text("utf-8")) == []


def test_nothing_is_marked_in_the_examples(editor: LanguageServer, root: Path) -> None:
    for example in sorted(root.glob("examples/*/swarm.yaml")):
        _, _, below = example.read_text("utf-8").partition("\n")
        assert editor.diagnostics(SPEC + below) == [], example


def test_nothing_is_marked_in_the_catalog(editor: LanguageServer, root: Path) -> None:
    for file in sorted(root.glob("templates/robots/*.yaml")):
        assert editor.diagnostics(ROBOT_TYPE + file.read_text("utf-8")) == [], file


@pytest.mark.parametrize(
    ("right", "wrong"),
    [("control", "contrl"), ("address", "adress"), ("user", "usr"), ("type", "typ"), ("usb", "ubs")],
)
def test_a_misspelt_key_is_marked_where_it_stands(
    right: str, wrong: str, editor: LanguageServer, swarm: Path
) -> None:
    text = (swarm / "swarm.yaml").read_text("utf-8").replace(f"{right}:", f"{wrong}:", 1)
    assert wrong in marked(editor, text)


def test_a_wrong_value_is_marked_where_it_stands(editor: LanguageServer, swarm: Path) -> None:
    text = (swarm / "swarm.yaml").read_text("utf-8").replace("mode: leader", "mode: leadr")
    assert marked(editor, text) == ["leadr"]


def test_a_misspelt_key_of_a_robot_type_is_marked(editor: LanguageServer, root: Path) -> None:
    text = (root / "templates/robots/epuck.yaml").read_text("utf-8")
    assert marked(editor, ROBOT_TYPE + text.replace("counter_bits:", "counter_bit:")) == ["counter_bit"]


@pytest.mark.parametrize(
    ("place", "definition"),
    [
        ("|", Spec),
        ("hosts:\n  k3-pi:\n    |", Host),
        ("hosts:\n  k3-pi: {a|}", Host),
        ("robots:\n  k3:\n    |", Robot),
        ("robots:\n  k3:\n    settings:\n      |", RobotSettings),
        ("links:\n  - kind: serial\n    |", Serial),
        ("links:\n  - kind: bluetooth\n    |", Bluetooth),
        ("programs:\n  joystick:\n    |", Program),
    ],
)
def test_every_key_is_offered_where_it_may_stand(
    place: str, definition: type[BaseModel], editor: LanguageServer
) -> None:
    keys = set(definition.model_fields)
    offered = editor.completion(f"{SPEC}{place}\n")
    assert keys - {"kind"} <= set(offered)
    assert all(offered[key].get("documentation") for key in keys - {"kind"})


def test_every_key_of_a_robot_type_is_offered(editor: LanguageServer) -> None:
    keys = {*RobotType.model_fields, *RosRobotType.model_fields}
    assert keys <= set(editor.completion(f"{ROBOT_TYPE}|\n"))


@pytest.mark.parametrize(
    ("place", "value"),
    [
        ("mode: |", "combined"),
        ("links:\n  - kind: |", "bluetooth"),
        ("links:\n  - kind: radio\n    uri: |", "radio://0/80/2M/E7E7E7E7E7"),
        ("links:\n  - kind: udp\n    address: |", "192.168.10.1"),
        ("links:\n  - kind: bluetooth\n    mac: |", "10:00:e8:c5:64:37"),
    ],
)
def test_values_are_offered(place: str, value: str, editor: LanguageServer) -> None:
    assert value in editor.completion(f"{SPEC}{place}\n")


@pytest.mark.parametrize(
    ("place", "definition", "key"),
    [
        ("mo|de: leader", Spec, "mode"),
        ("hosts:\n  k3-pi: {addr|ess: 192.168.77.11}", Host, "address"),
        ("links:\n  - {kind: serial, u|sb: {serial: x}}", Serial, "usb"),
        ("robots:\n  k3:\n    settings: {command_time|out: 0.4}", RobotSettings, "command_timeout"),
    ],
)
def test_hover_over_a_key_shows_what_it_is_for(
    place: str, definition: type[BaseModel], key: str, editor: LanguageServer
) -> None:
    shown = editor.hover(f"{SPEC}{place}\n")
    assert str(definition.model_fields[key].description) in shown
    assert "Example" in shown


def test_the_modeline_of_other_editors_works_alone(editor: LanguageServer) -> None:
    assert "How the robots work together." in editor.hover(
        "# $schema: .swarmctl/swarm.schema.json\nmo|de: leader\n"
    )


@pytest.mark.parametrize(
    ("file", "missing"),
    [
        ("swarm.yaml", "mode"),
        ("hall/big.swarm.yaml", "mode"),
        ("robots/rover.yaml", "kinematics"),
        ("other.yaml", ""),
    ],
)
def test_the_settings_for_vs_code_need_no_modeline(
    file: str, missing: str, server: Path, swarm: Path, root: Path
) -> None:
    settings = json.loads((root / "docs/snippets/vscode-settings.json").read_text("utf-8"))
    with running(server, swarm, {"schemas": settings["yaml.schemas"]}) as editor:
        messages = [found["message"] for found in editor.diagnostics("title: x\n", file)]
    assert (f'Missing property "{missing}".' in messages) is bool(missing)
