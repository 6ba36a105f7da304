"""Every format's quoting, shown with the format's own parser: what went in comes out, or it was refused."""

from __future__ import annotations

import json
import re
import shlex
import shutil
import subprocess
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Callable

import jinja2
import pytest
import yaml
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from swarmctl.diagnostics import has_errors
from swarmctl.linter.runner import lint
from swarmctl.render import quoting
from swarmctl.render.build_bundle import bundles
from swarmctl.render.quoting import LITERALS, UnsafeValueError
from swarmctl.spec.catalog import load_catalog
from swarmctl.spec.load import load_text
from swarmctl.swarm.resolve import resolve
from swarmctl.yamltext.compose import DIRECTIONS
from swarmctl.yamltext.source import parse

CATALOG = load_catalog()
HOSTILE = [
    "",
    " ",
    "'",
    '"',
    "\\",
    "$HOME",
    "$(reboot)",
    "`reboot`",
    "%n",
    "%%",
    "a\\",
    "#",
    ";",
    "&&",
    "~",
    "*",
    "!x",
]
HOSTILE += ["-oProxyCommand=x", "]]>", '"/><node/>', "${IFS}", "a b c", "é", "=x", "{x,y}", "@x"]

_ODD = "\u2028\u2029\ufffe\uffff" + "".join(sorted(DIRECTIONS))  # no spec has them
one_line = st.one_of(
    st.sampled_from(HOSTILE),
    st.text(st.characters(exclude_categories=("Cc", "Cs"), exclude_characters=_ODD), max_size=30),
    st.text(" \"'\\$`%;#&|<>(){}[]*?!~=ab", max_size=12),
)
several_lines = st.one_of(
    one_line, st.lists(one_line, max_size=4).map("\n".join), st.lists(one_line, max_size=4).map("\n\t".join)
)


def shells() -> list[list[str]]:
    known = (["dash"], ["bash", "--posix"], ["bash"], ["busybox", "sh"])
    return [shell for shell in known if shutil.which(shell[0])]


def printed(shell: list[str], script: str) -> list[str]:
    ran = subprocess.run([*shell], input=script.encode(), capture_output=True, check=True)
    return ran.stdout.decode().split("\0")[:-1]


@settings(max_examples=40)
@given(st.lists(one_line, min_size=1, max_size=30))
@example(HOSTILE)
def test_shell_words(values: list[str]) -> None:
    script = "printf '%s\\0' " + " ".join(quoting.shell(value) for value in values) + "\n"
    for shell in shells():
        assert printed(shell, script) == values
    assert shlex.split(script)[2:] == values


@settings(max_examples=40)
@given(st.lists(one_line, min_size=1, max_size=30))
@example(HOSTILE)
def test_environment_files_to_a_shell_and_to_systemd(values: list[str]) -> None:
    lines = [f"V{number}={quoting.environment_file(value)}" for number, value in enumerate(values)]
    prints = [f"printf '%s\\0' \"$V{number}\"" for number in range(len(values))]
    script = "\n".join([*lines, *prints]) + "\n"
    for shell in shells():
        assert printed(shell, script) == values
    assert [environment_value(line.partition("=")[2]) for line in lines] == values


def environment_value(text: str) -> str:
    """A double-quoted value of an EnvironmentFile= as systemd.exec(5) reads it."""
    assert text[0] == text[-1] == '"'
    return re.sub(r'\\(["\\`$])', r"\1", text[1:-1])


@given(one_line)
def test_words_of_a_units_command(value: str) -> None:
    assert command_words(f"/bin/x {quoting.systemd(value)} end") == ["/bin/x", value, "end"]


def command_words(line: str) -> list[str]:
    """The words of an ExecStart= as systemd.syntax(7) splits and systemd.service(5) expands them."""
    words, at = [], 0
    while at < len(line):
        if line[at] == " ":
            at += 1
            continue
        word, quote = "", ""
        while at < len(line) and (quote or line[at] != " "):
            char = line[at]
            if char == "\\":
                word += line[at + 1]
                at += 2
                continue
            if char == quote:
                quote = ""
            elif not quote and char in "\"'":
                quote = char
            else:
                word += char
            at += 1
        assert not quote
        assert not re.search(r"(?<!%)(%%)*%(?!%)", word), "a specifier would be expanded"
        assert not re.search(r"(?<!\$)(\$\$)*\$(?!\$)", word), "a variable would be expanded"
        words.append(word.replace("%%", "%").replace("$$", "$"))
    return words


@given(one_line)
def test_sentences_expand_to_what_they_were(value: str) -> None:
    if value.endswith("\\"):
        with pytest.raises(UnsafeValueError):
            quoting.sentence(value)
    else:
        written = quoting.sentence(value)
        assert not re.search(r"(?<!%)(%%)*%(?!%)", written)
        assert written.replace("%%", "%") == value


@given(several_lines)
def test_attributes(value: str) -> None:
    if "$(" in value:
        with pytest.raises(UnsafeValueError):
            quoting.xml(value)
        return
    (node,) = ET.fromstring(f"<launch><node args={quoting.xml(value)} /></launch>")
    assert node.attrib == {"args": value}
    assert list(node) == []


@pytest.mark.parametrize("literal", [quoting.udev, quoting.hosts, quoting.variable])
@given(value=one_line)
def test_formats_without_quoting_let_only_plain_words_pass(literal: Callable[[str], str], value: str) -> None:
    try:
        written = literal(value)
    except UnsafeValueError:
        return
    assert written == value
    assert re.fullmatch(r"[A-Za-z0-9:._/+=@,#&() -]*", value, re.ASCII)


@pytest.mark.parametrize(
    "literal", sorted({*LITERALS.values(), quoting.sentence, quoting.variable, quoting.path}, key=repr)
)
@given(
    before=st.text("ab", max_size=3),
    control=st.sampled_from("\n\r\t\0\x0b\x0c\x1b\x7f\x85\u2028\u2029\ud800"),
)
def test_control_characters_are_refused_everywhere(
    literal: Callable[[str], str], before: str, control: str
) -> None:
    for value in (before + control, control + before, before + control + "x", before + "\r\n"):
        if literal in (quoting.xml, quoting.launch_xml) and control in "\n\t" and "\r" not in value:
            continue  # written as references
        with pytest.raises(UnsafeValueError):
            literal(value)


@pytest.mark.parametrize(("value", "text"), [(True, "true"), (False, "false"), (7, "7"), (0.5, "0.5")])
def test_numbers_and_booleans(value: object, text: str) -> None:
    assert quoting.shell(value) == quoting.systemd(value) == text
    assert quoting.xml(value) == quoting.environment_file(value) == f'"{text}"'


def test_a_value_that_is_missing_is_an_error_not_nothing() -> None:
    with pytest.raises(jinja2.UndefinedError):
        quoting.render("swarm.target", swarm="x")


NAMES = st.from_regex(r"[a-z][a-z0-9-]{0,20}", fullmatch=True).filter(
    lambda name: name not in ("master", "localhost")
)
HOSTS = st.sampled_from(["10.0.0.1", "192.168.77.254", "koala.local"])
PLAIN = {"swarm": "plain", "robot": "r", "title": "T", "usb": "A", "device": "/dev/x", "address": "10.0.0.1"}
SPEC = """\
version: 1
name: {swarm}
mode: leader
leader: only
hosts:
  only: {{address: "{address}"}}
types:
  odd:
    title: {title}
    link: {{kinds: [serial], baud: 9600}}
    kinematics:
      wheel_separation: 0.3
      wheel_speed_max: 0.5
      scales: [{{speed_units_per_mps: 1.0, metres_per_count: 0.1}}]
    protocol: {{kind: line, set_speed: {{send: "D,{{left}},{{right}}", reply: d}}}}
    firmware_dead_man: false
robots:
  {robot}: {{type: odd, host: only}}
  other-{robot}: {{type: odd, host: only}}
links:
  - {{kind: serial, host: only, robot: {robot}, usb: {{serial: "{usb}"}}}}
  - {{kind: serial, host: only, robot: other-{robot}, device: "{device}"}}
"""


@settings(max_examples=300)
@given(one_line)
@example("no")
@example("null")
@example("10:00:52:14:33:11")
@example("1e3")
@example("192.168.77.10")
@example("Yes")
def test_yaml_scalars_to_both_versions_of_yaml(value: str) -> None:
    text = f"{{key: {quoting.scalar(value)}}}\n"
    assert yaml.safe_load(text) == {"key": value}
    assert parse(text, "swarm.yaml")[0].data == {"key": value}


@settings(max_examples=60)
@given(
    values=st.fixed_dictionaries(
        {
            "swarm": NAMES,
            "robot": NAMES,
            "title": one_line,
            "usb": st.from_regex(r"[A:._/+=@,#&()-]([A:._/+=@,#&() -]{0,8}9)?", fullmatch=True),
            "device": st.from_regex(r"/dev/ttyX[A-Za-z0-9_:=@,~-]{1,8}", fullmatch=True),
            "address": HOSTS,
        }
    )
)
def test_no_value_of_a_spec_brings_a_line_of_its_own(values: dict[str, str]) -> None:
    files = files_of(values)
    assert shape(files) == shape(files_of(PLAIN))
    for path, content in files.items():
        if path.startswith("params/"):
            params = yaml.safe_load(content)
            assert (params["title"], params["robot"]) == (values["title"], path[7:-5])
    subprocess.run(["bash", "-n"], input=files["setup.bash"], check=True)


def files_of(values: dict[str, str], more: str = "") -> dict[str, bytes]:
    text = SPEC.format(**{**values, "title": json.dumps(values["title"], ensure_ascii=False)})
    document, found = load_text(text + more, "swarm.yaml", CATALOG)
    assert document is not None, found
    assume(not has_errors(lint(document)))
    (bundle,) = bundles(resolve(document)).values()
    return {file.path: file.content for file in bundle.files}


def shape(files: dict[str, bytes]) -> list[tuple[str, ...]]:
    """The skeleton of every file: the keys of its lines, the elements and attributes of its tree."""
    shapes = []
    for path, content in files.items():
        ending = path.rpartition(".")[2]
        lines = content.decode().splitlines()
        if ending == "launch":
            shapes.append(
                (ending, *(f"{one.tag} {sorted(one.attrib)}" for one in ET.fromstring(content).iter()))
            )
        elif ending in ("service", "target", "env", "rules"):
            keys = [line.partition("=")[0] for line in lines]
            shapes.append((ending, *("ROS_IP" if key == "ROS_HOSTNAME" else key for key in keys)))
        elif ending == "bash":
            shapes.append((ending, str(len(lines))))
    return sorted(shapes)


PROGRAM = """\
programs:
  wander:
    host: only
    package: wander
    executable: wander.py
    params: {{text: {text}, number: 1.0e-07}}
    environment: {{NOTE: {note}}}
  teleop: {{host: only, use: teleop-joy, environment: {{NOTE: {note}}}}}
  deep: {{host: only, package: wander, launch: deep.launch, params: {{text: {argument}}}, optional: true}}
control: [{{by: teleop, of: [r]}}]
"""


@settings(max_examples=60)
@given(text=several_lines, note=one_line, argument=several_lines)
@example("{{x}", "{", "{host}")
@example("deg(90)", 'a "b" & <c> %n $HOME', "")
@example("$(eval 1)", "", "<a>\n\t<b/>\n</a>\n")
@example('<?xml version="1.0"?>\n<robot name="r">\n\t<link name="base"/>\n</robot>\n', "rad(pi)", "1e3")
def test_no_value_of_a_program_is_read_as_anything_else(text: str, note: str, argument: str) -> None:
    assume("$(" not in note + argument)  # PROG016 refuses it: roslaunch has no escape for it
    values = {"text": text, "note": note, "argument": argument}
    braces = str.maketrans({"{": "{{", "}": "}}"})  # one alone would begin a placeholder
    written = {key: json.dumps(one.translate(braces), ensure_ascii=False) for key, one in values.items()}
    files = files_of(PLAIN, PROGRAM.format(**written))
    plain = files_of(PLAIN, PROGRAM.format(text='"x"', note='"x"', argument='"x"'))
    assert shape(files) == shape(plain)
    assert yaml.safe_load(files["params/wander.yaml"]) == {"text": text, "number": 1e-7}
    assert not re.search(rb": (deg|rad)\(", files["params/wander.yaml"])
    assert [one.get("value") for one in ET.fromstring(files["launch/wander.launch"]).iter("env")] == [note]
    assert [one.get("value") for one in ET.fromstring(files["launch/deep.launch"]).iter("arg")] == [argument]
    unit = files["units/swarm-plain.teleop.service"].decode()
    (command,) = (line.partition("=")[2] for line in unit.splitlines() if line.startswith("ExecStart="))
    assert f"NOTE={note}" in command_words(command)


@pytest.mark.skipif(not shutil.which("gcc"), reason="gcc is missing")
@settings(max_examples=10)
@given(st.lists(one_line, min_size=1, max_size=30))
def test_a_compiler_reads_texts_as_they_were(texts: list[str]) -> None:
    source = "#include <stdio.h>\nint main(void) {\n"
    source += "".join(f"fwrite({quoting.c(text)}, 1, {len(text.encode())} + 1, stdout);\n" for text in texts)
    with tempfile.TemporaryDirectory() as folder:
        command = ["gcc", "-std=c11", "-trigraphs", "-x", "c", "-o", f"{folder}/print", "-"]
        subprocess.run(command, input=f"{source}}}\n".encode(), check=True)
        output = subprocess.run([f"{folder}/print"], capture_output=True, check=True).stdout
    assert output.decode().split("\0")[:-1] == texts


@pytest.mark.parametrize(
    ("value", "literal"), [(True, "true"), (57600, "57600"), (0.0325, "0.0325f"), (1e-05, "1e-05f")]
)
def test_numbers_in_c(value: float, literal: str) -> None:
    assert quoting.c(value) == literal


@pytest.mark.parametrize("value", [float("nan"), float("inf"), "line\nbreak"])
def test_what_c_has_no_literal_for_is_refused(value: object) -> None:
    with pytest.raises(UnsafeValueError):
        quoting.c(value)


def test_a_package_is_found_as_ros2_launch_calls_it() -> None:
    assert quoting.launch_xml("$(find slam)/map.yaml") == '"$(find-pkg-share slam)/map.yaml"'
    with pytest.raises(UnsafeValueError):
        quoting.launch_xml("$(eval 1 + 1)")
