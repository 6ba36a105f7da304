"""``swarmctl driver new``: by flags and by answers, right before it is written, never over another file."""

from __future__ import annotations

import os
import pty
import re
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from swarmctl.cli import exits
from swarmctl.cli.app import run
from swarmctl.render.own_parts import PARTS, completed, questions_of, read_part
from swarmctl.render.own_type import QUESTIONS, complaint, questions
from swarmctl.render.questions import typed
from swarmctl.spec.catalog import load_catalog

GOLDEN = Path(__file__).parent / "golden/driver-new"
PROGRAM = str(Path(sys.executable).with_name("swarmctl"))
BODY = (
    "--wheel-separation", "0.08", "--wheel-speed-max", "0.25", "--units-per-mps", "1000",
    "--metres-per-count", "1e-5",
)  # fmt: skip
ROBOTS = {
    "beetle": (
        "--title", "Beetle: a robot", *BODY, "--counter-bits", "16",
        "--set-speed", "S,{left},{right}", "--reply", "s",
        "--position", "P", "--position-reply", "p", "--identify", "B", "--identify-reply", "b",
        "--error-head", "!", "--terminator", "lf", "--link", "serial, bluetooth", "--hint", "is it asleep?",
    ),
    "cricket": (
        "--title", "Cricket", *BODY, "--set-speed", "S,{left},{right}", "--reply", "s",
        "--raw", "name=floor names=left,right send=F reply=f",
        "--raw", "name=noise names=level send='N 1' reply=n rate=2",
        "--range", "name=eyes names=left,right,back send=E reply=e headings=20,-20,180 distances=9:0.3,99:0",
        "--battery", "send=V reply=v volts=0.01 empty=3.4 full=4.2",
        "--lights", "name=leds channels=a,b send=L,{index},{value} reply=l",
        "--lights", "name=lamp channels=lamp send=M,{value} reply=m max=255",
    ),
    "firefly": (
        "--protocol", "binary", "--title", "Firefly", *BODY, "--set-speed", "bc {left:h} {right:h}",
        "--position", "a0", "--raw", "name=floor names=left,right send=66 reply=2B",
        "--lights", "name=lamp channels=lamp send='b4 {value:b}'",
    ),
    "leech": (
        "--protocol", "python", "--title", "Leech", *BODY, "--raw", "name=skin names=left,right",
        "--lights", "name=lamp channels=lamp",
    ),
    "blind": (
        "--title", "Blind", *BODY, "--set-speed", "S{left};{right}", "--reply", "ok", "--dead-man", "yes",
    ),
    "moth": (
        "--protocol", "binary", "--title", "Moth", *BODY, "--set-speed", "bc {left:h} {right:h}",
        "--position", "a0", "--position-reply", "2i",
    ),
    "snail": ("--protocol", "python", "--title", "Snail", *BODY, "--link", "bluetooth"),
}  # fmt: skip


EYES = "name=e names=a,b send=E reply=e distances=10:0.3,255:0"
OF_A_CLASS = ("snail", "leech")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("name", ROBOTS)
def test_flags_make_a_type(name: str, folder: Path, golden: Callable[[Path, str], None]) -> None:
    assert run(["driver", "new", name, *ROBOTS[name]]) == exits.OK
    golden(GOLDEN / f"{name}.yaml", (folder / f"robots/{name}.yaml").read_text())
    catalog = load_catalog(folder / "robots")
    assert catalog.diagnostics == ()
    assert catalog.types[name].kinematics.scales[0].metres_per_count == 1e-5
    assert ((folder / f"robots/{name}.py").exists(), name in catalog.codecs) == (name in OF_A_CLASS,) * 2


@pytest.mark.parametrize("name", ROBOTS)
def test_every_example_in_the_file_is_ready(name: str, folder: Path) -> None:
    """Without its # it is right: the topic is there."""
    run(["driver", "new", name, *ROBOTS[name]])
    file = folder / f"robots/{name}.yaml"
    before = load_catalog(folder / "robots").types[name]
    file.write_text(
        re.sub(r"^( *)# (?= *(?:[a-z]+: |distances|elements|\{name))", r"\1", file.read_text(), flags=re.M)
    )
    catalog = load_catalog(folder / "robots")
    assert catalog.diagnostics == ()
    after = catalog.types[name]
    assert {one.kind for one in after.sensors.values()} >= {"raw", "range", "battery"}
    assert after.actuators
    assert before.sensors.items() <= after.sensors.items()


def test_the_class_to_begin_with_knows_every_question(folder: Path) -> None:
    run(["driver", "new", "leech", *ROBOTS["leech"]])
    assert '{"position": "P", "skin": "SKIN"}[name]' in (folder / "robots/leech.py").read_text()


def test_the_class_to_begin_with_speaks_lines(folder: Path) -> None:
    """The skeleton is a whole codec: numbers in, bytes out, and back."""
    from swarm_driver.own import OwnCodec
    from swarm_driver.protocols import PythonProtocol

    run(["driver", "new", "snail", *ROBOTS["snail"]])
    protocol = PythonProtocol(0.2, folder / "robots/snail.py", "SnailCodec", {}, True, {"position": 2})
    codec = OwnCodec(protocol)
    assert codec.speed(-5, 7).data == b"S,-5,7\r"
    reader = codec.query("position").reader()
    assert reader.feed(b"noise\r\np,1") is None
    reply = reader.feed(b"2,-3\r\n")
    assert (reply and reply.values, reader.noise) == ((12, -3), 1)


def test_a_folder_that_cannot_be_is_told(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "file").touch()
    for place, why in (("x" * 300, "file name too long"), ("file", "not a directory")):
        assert run(["driver", "new", "snail", "--dir", place, *ROBOTS["snail"]]) == exits.ERROR
        told = capsys.readouterr().err.lower()
        assert f"cannot write {place}" in told.replace("\n", " ")
        assert why in told.replace("\n", " ")
        assert "choose another --dir" in told


def test_nothing_is_written_over(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["driver", "new", "snail", *ROBOTS["snail"]]) == exits.OK
    (folder / "robots/snail.py").write_text("mine")
    assert run(["driver", "new", "snail", *ROBOTS["snail"]]) == exits.ERROR
    (folder / "robots/snail.yaml").unlink()
    assert run(["driver", "new", "snail", *ROBOTS["snail"]]) == exits.ERROR
    assert "robots/snail.py is there already" in capsys.readouterr().err
    assert (folder / "robots/snail.py").read_text() == "mine"
    assert run(["driver", "new", "snail", "--force", *ROBOTS["snail"]]) == exits.OK
    assert "class SnailCodec" in (folder / "robots/snail.py").read_text()


@pytest.mark.parametrize(
    ("flags", "told"),
    [
        ((), "these are needed: --title, --wheel-separation, --wheel-speed-max, --units-per-mps"),
        ((*ROBOTS["blind"], "--baud", "fast"), "--baud: `fast` is no whole number, like 115200"),
        ((*ROBOTS["blind"], "--baud", "12"), "--baud: `baud` cannot be `12` (must be 300 or more)"),
        ((*ROBOTS["blind"], "--wheel-speed-max", "inf"), "--wheel-speed-max: inf is no number"),
        ((*ROBOTS["blind"], "--set-speed", "S,{left}"), "needs {left} and {right}, once each"),
        ((*ROBOTS["blind"], "--title", "a\nb"), "--title: 'a\\nb' holds control characters"),
        ((*ROBOTS["blind"], "--link", "usb"), "cannot be `usb`"),
        ((*ROBOTS["blind"], "--protocol", "morse"), "--protocol: `morse` is none of line, binary, python"),
        ((*ROBOTS["blind"], "--dead-man", "perhaps"), "--dead-man: `perhaps` is neither yes nor no"),
        ((*ROBOTS["blind"], "--terminator", "crlf"), "--terminator: `crlf` is neither cr nor lf"),
        ((*ROBOTS["moth"], "--set-speed", "bc {left:h}"), "needs {left:h} and {right:h}, once each"),
        ((*ROBOTS["blind"], "--raw", "name=floor"), "--raw: it needs names=left,right, send=F, reply=f"),
        ((*ROBOTS["blind"], "--raw", "colour=red"), "--raw: `colour=red` is none of name=, names="),
        ((*ROBOTS["blind"], "--raw", "name=a b"), "--raw: `b` is none of name="),
        ((*ROBOTS["blind"], "--raw", "name='a"), "a quotation mark or a backslash stands alone"),
        ((*ROBOTS["blind"], "--raw", "name=a names=a send=F reply=f name=b"), "`name=` stands there twice"),
        ((*ROBOTS["blind"], "--raw", "name=Floor names=a send=F reply=f"), "cannot be `Floor`"),
        ((*ROBOTS["blind"], *2 * ("--raw", "name=a names=a send=F reply=f")), "key `a` stands here twice"),
        ((*ROBOTS["blind"], "--range", EYES + " headings=1"), "2 names need as many headings, not 1"),
        ((*ROBOTS["blind"], "--range", EYES + " headings=1,x"), "--range: `x` is no number, like 20.0"),
        ((*ROBOTS["blind"], "--range", EYES.replace("10:", "") + " headings=1,2"), "`0.3` is no pair, like"),
        ((*ROBOTS["blind"], "--range", EYES.replace(",255:0", "") + " headings=1,2"), "has too few entries"),
        ((*ROBOTS["blind"], "--battery", "send=V reply=v volts=1 empty=5 full=4"), "`empty` must be below"),
        ((*ROBOTS["blind"], "--lights", "name=l channels=a,b send=L,{value}"), "needs {value}, and {index}"),
        ((*ROBOTS["moth"], "--raw", "name=f names=a,b send=66 reply=1B"), "has 1 values, sensor `f` takes 2"),
        ((*ROBOTS["snail"], "--raw", "name=f names=a send=F"), "--raw: `send=F` is none of name=, names="),
        ((*ROBOTS["moth"], "--identify", "V"), "--identify is nothing for a protocol of kind binary"),
    ],
    ids=lambda value: value[:40] if isinstance(value, str) else "",
)  # fmt: skip
def test_wrong_flags_are_told_and_nothing_is_written(
    flags: tuple[str, ...], told: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["driver", "new", "ant", *flags]) == exits.USAGE
    assert told in capsys.readouterr().err
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize("name", ["Ant", "../ant", "ant beetle", "1ant", ""])
def test_a_name_that_is_none(name: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["driver", "new", name, *ROBOTS["blind"]]) == exits.USAGE
    assert "is no name for a type" in capsys.readouterr().err
    assert list(folder.iterdir()) == []


def test_what_no_flag_says_is_asked_for_until_it_is_right(folder: Path) -> None:
    """On a terminal: a wrong answer gets a sentence, and another try; Enter takes the default."""
    answers = ["Ant", "", "", "quick", "57600", "80 mm", "0.08", "0.25", "1000", "0.001", "", "S,{left}",
               "S,{left},{right}", "s", "", "", "", "", "", "", "",
               "wheels", "raw", "Floor", "floor", "left,right", "F", "f", "",
               "battery", "", "V", "v", "a lot", "0.01", "5", "3.4", "4.2", "",
               "lights", "leds", "a,b", "L,{value}", "L,{index},{value}", "", "", ""]  # fmt: skip
    mine, theirs = pty.openpty()
    with subprocess.Popen(
        [PROGRAM, "driver", "new", "ant"], cwd=folder, stdin=theirs, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True, env={**os.environ, "NO_COLOR": "1"},
    ) as process:  # fmt: skip
        os.close(theirs)
        os.write(mine, "".join(f"{one}\n" for one in answers).encode())
        out, err = process.communicate(timeout=30)
    os.close(mine)
    assert process.returncode == exits.OK, err
    assert "`quick` is no whole number, like 115200" in err
    assert "`80 mm` is no number, like 0.1" in err
    assert "needs {left} and {right}, once each" in err
    assert out.lstrip().startswith("robots/ant.yaml: written\n")
    made = load_catalog(folder / "robots").types["ant"]
    assert "`wheels` is none of raw, range, battery, lights" in err
    assert "cannot be `Floor`" in err
    assert "`a lot` is no number, like 0.01" in err
    assert "`empty` must be below `full`" in err
    assert "needs {value}, and {index} where it has several channels" in err
    assert {name: one.kind for name, one in made.sensors.items()} == {"floor": "raw", "battery": "battery"}
    assert made.actuators["leds"].channels == ("a", "b")
    assert (made.title, made.link.baud, made.kinematics.wheel_separation) == ("Ant", 57600, 0.08)


@pytest.mark.parametrize("protocol", ["line", "binary", "python"])
def test_the_samples_are_right_answers(protocol: str) -> None:
    """Each question is judged with the samples of the others: these must be right themselves."""
    assert complaint("ant", {"protocol": protocol}) is None
    assert questions(protocol, {one.name: one.sample for one in QUESTIONS}) == []


@pytest.mark.parametrize("protocol", ["line", "binary", "python"])
@pytest.mark.parametrize("kind", PARTS)
def test_a_flag_says_what_the_questions_ask(kind: str, protocol: str) -> None:
    """The samples of all questions, typed as a flag: the same part."""
    asked = questions_of(kind, protocol)
    flag = " ".join(f"{one.name}={shlex.quote(typed(one.sample))}" for one in asked)
    part = read_part(kind, protocol, flag)
    assert part == {"kind": kind, **{one.name: one.sample for one in asked}}
    assert completed(part, protocol) == completed({"kind": kind}, protocol) | {"reply": part.get("reply")}
    assert complaint("ant", {"protocol": protocol, "parts": [part]}) is None
