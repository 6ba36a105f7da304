"""``swarmctl driver new``: by flags and by answers, right before it is written, never over another file."""

from __future__ import annotations

import os
import pty
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from swarmctl.cli import exits
from swarmctl.cli.app import run
from swarmctl.render.own_type import QUESTIONS, complaint, questions
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
    "blind": (
        "--title", "Blind", *BODY, "--set-speed", "S{left};{right}", "--reply", "ok", "--dead-man", "yes",
    ),
    "moth": (
        "--protocol", "binary", "--title", "Moth", *BODY, "--set-speed", "bc {left:h} {right:h}",
        "--position", "a0", "--position-reply", "2i",
    ),
    "snail": ("--protocol", "python", "--title", "Snail", *BODY, "--link", "bluetooth"),
}  # fmt: skip


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
    assert ((folder / f"robots/{name}.py").exists(), name in catalog.codecs) == (name == "snail",) * 2


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
               "S,{left},{right}", "s", "", "", "", "", "", "", ""]  # fmt: skip
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
    assert (made.title, made.link.baud, made.kinematics.wheel_separation) == ("Ant", 57600, 0.08)


@pytest.mark.parametrize("protocol", ["line", "binary", "python"])
def test_the_samples_are_right_answers(protocol: str) -> None:
    """Each question is judged with the samples of the others: these must be right themselves."""
    assert complaint("ant", {"protocol": protocol}) is None
    assert questions(protocol, {one.name: one.sample for one in QUESTIONS}) == []
