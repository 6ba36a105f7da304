"""``swarmctl capsule``: what is intact, what is not, how many trials succeed, and what their bags show."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import jsonschema
import pytest

from swarmctl.capsule.capsule_index import INDEX, SIGNATURE
from swarmctl.capsule.folder import write
from swarmctl.capsule.signature import sign, signer
from swarmctl.cli import exit_codes
from tests.capsule.trial_folder import ABOUT, edit, filled
from tests.in_process import swarmctl
from tests.ui.bag_files import BEGAN, odometry
from tests.ui.bag_files import write as write_bag

GOLDEN = Path(__file__).parent / "golden/capsule"


@pytest.fixture
def trials(tmp_path: Path) -> Path:
    """Three trials of one experiment and one of another, in a folder of a folder."""
    for number, changes in enumerate(
        (
            {},
            {"outcome": "failed", "cause": "k3 lost its commander: \x1b[2J", "skew": None},
            {},
            {"experiment": "line", "outcome": "interrupted", "cause": "Ctrl-C"},
        )
    ):
        moments = {"began": 1_780_000_000 + 100 * number, "ended": 1_780_000_060.5 + 100 * number}
        folder = filled(tmp_path / f"trials/circle-{number}")
        write(folder, ABOUT | {"trial": number, **moments, **changes})
    return tmp_path


def capsule(folder: Path, *arguments: str) -> Any:
    return swarmctl("capsule", *arguments, cwd=folder)


def test_intact_capsules_are_one_line_each(trials: Path) -> None:
    subprocess.run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", trials / "key"], check=True)
    sign(trials / "trials/circle-0", trials / "key")
    ran = capsule(trials, "verify", "trials/circle-0", "trials/circle-1")
    assert ran.returncode == exit_codes.OK
    assert ran.stdout.splitlines() == [
        f"trials/circle-0  intact, signed by {signer(trials / 'trials/circle-0').fingerprint}",
        "trials/circle-1  intact, not signed",
    ]


def test_one_that_is_not_intact_is_an_error(trials: Path) -> None:
    broken = trials / "trials/circle-1"
    (broken / "spec/night.yaml").write_text("robots: []\n")
    (broken / "notes.txt").touch()
    (broken / SIGNATURE).write_text("no signature")
    ran = capsule(trials, "verify", "trials/circle-1", "trials/circle-0", "trials")
    assert ran.returncode == exit_codes.ERROR
    first, second, third = ran.stdout.splitlines()
    assert first.startswith("trials/circle-1  notes.txt was added; spec/night.yaml has changed; ")
    assert f"{SIGNATURE} does not fit" in first
    assert second == "trials/circle-0  intact, not signed"
    assert third == "trials  trials is not a capsule: it has no index.json"
    document = json.loads(capsule(trials, "verify", "trials/circle-1", "trials/circle-0", "--json").stdout)
    assert [(one["folder"], one["intact"]) for one in document["capsules"]] == [
        ("trials/circle-1", False),
        ("trials/circle-0", True),
    ]
    assert document["capsules"][0]["problems"][:1] == ["notes.txt was added"]


@pytest.fixture
def nepal(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The clock of this machine is 5 h 45 min ahead of UTC."""
    monkeypatch.setenv("TZ", "NPT-5:45")
    time.tzset()
    yield
    monkeypatch.undo()
    time.tzset()


@pytest.mark.usefixtures("nepal")
def test_trials_are_a_table(trials: Path, golden: Callable[[Path, str], None]) -> None:
    ran = capsule(trials, "show", ".", "trials/circle-3")
    assert (ran.returncode, ran.stderr) == (exit_codes.OK, "")
    golden(GOLDEN / "trials.txt", ran.stdout)
    document = json.loads(capsule(trials, "show", ".", "--json").stdout)
    assert [one["folder"] for one in document["trials"]] == [f"trials/circle-{number}" for number in range(4)]
    assert document["trials"][1]["outcome"] == "failed"
    circle, line = document["experiments"]
    assert (circle["experiment"], circle["completed"], circle["trials"]) == ("circle", 2, 3)
    assert circle["interval"] == pytest.approx([0.2077, 0.9385], abs=1e-4)
    assert (line["experiment"], line["completed"], line["trials"]) == ("line", 0, 1)


def test_a_damaged_index_costs_its_trial_alone(trials: Path) -> None:
    (trials / "trials/circle-0" / INDEX).write_text("{")
    (trials / "empty").mkdir()
    ran = capsule(trials, "show", "trials", "empty")
    assert ran.returncode == exit_codes.ERROR
    assert "1 of 2 completed" in ran.stdout
    assert "error: trials/circle-0/index.json is not an index: Invalid JSON" in ran.stderr
    assert "error: empty is not a capsule" in ran.stderr
    assert "  help: " in ran.stderr
    document = json.loads(capsule(trials, "show", "trials", "empty", "--json").stdout)
    assert list(document["errors"]) == ["trials/circle-0", "empty"]


def test_the_schema_fits_an_index(trials: Path) -> None:
    schema = json.loads(swarmctl("schema", "capsule").stdout)
    jsonschema.Draft202012Validator.check_schema(schema)
    index = json.loads((trials / "trials/circle-1" / INDEX).read_text("utf-8"))
    jsonschema.validate(index, schema)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(index | {"outcome": "great"}, schema)
    assert swarmctl("schema", "capsule", "--markdown").returncode == exit_codes.USAGE


@pytest.fixture
def driven(tmp_path: Path) -> Path:
    """Trials with two speeds, whose bags have the odometry of two robots, in a folder of a folder."""
    reached = {"topic": "k3/odom", "condition": "reached", "wanted": 0.1, "found": 0.02, "met": True}
    missed = reached | {"found": 0.5, "met": False}
    for number, (speed, changes) in enumerate(
        (
            (0.1, {"success": True, "judged": [reached]}),
            (0.1, {"success": False, "judged": [missed]}),
            (0.2, {"success": False, "outcome": "failed", "cause": "k3 lost its commander: \x1b[2J"}),
            (0.2, {"success": False, "outcome": "failed", "cause": "k3 lost its commander: \x1b[2J"}),
            (0.2, {"success": True, "judged": [reached]}),
        )
    ):
        began = BEGAN + 100 * number
        hosts = {"k3-pi": ABOUT["hosts"]["k3-pi"] | {"began": began}}
        moments = {"trial": number, "began": began, "ended": began + 60 + number, "hosts": hosts}
        folder = filled(tmp_path / f"trials/circle-{number}")
        (folder / "bags/k3-pi_0.bag").unlink()
        recorded = [
            (100.0 * number + at, *odometry(speed * at, float(index), speed=speed, robot=robot))
            for at in (0.5, 1.0, 1.5)
            for index, robot in enumerate(("k3", "_$^$"))
        ]
        write_bag(folder / "bags/k3-pi_0.bag", recorded)
        write(folder, ABOUT | moments | changes | {"parameters": {"wander": {"speed": speed}}})
        edit(folder, lambda index: index["parameters"]["wander"].update(name="a b"))
    return tmp_path


def test_trials_are_compared_by_parameters(driven: Path, golden: Callable[[Path, str], None]) -> None:
    ran = capsule(driven, "compare", ".")
    assert (ran.returncode, ran.stderr) == (exit_codes.OK, "")
    golden(GOLDEN / "compared.txt", ran.stdout)
    document = json.loads(capsule(driven, "compare", "trials", "--json").stdout)
    slow, fast = document["experiments"]
    assert (slow["trials"], slow["completed"], slow["succeeded"], slow["seconds"]) == (2, 2, 1, 60.5)
    assert (fast["trials"], fast["completed"], fast["succeeded"], fast["seconds"]) == (3, 1, 1, 63.0)
    assert slow["causes"] == {"k3/odom: reached is not met": 1}
    assert fast["interval"] == pytest.approx([0.0615, 0.7923], abs=1e-4)
    assert document["errors"] == {}


def test_the_drawing_has_all_robots_and_trials(driven: Path) -> None:
    ran = capsule(driven, "compare", "trials", "--plot", "moved.svg", "--json")
    assert (ran.returncode, ran.stderr) == (exit_codes.OK, "")
    assert len(json.loads(ran.stdout)["experiments"]) == 2
    text = (driven / "moved.svg").read_text("utf-8")
    ElementTree.fromstring(text)
    assert text.count("<!-- /k3/odom -->") == text.count("<!-- /_$^$/odom -->") == 1
    assert text.count('id="line2d_') > 2 * 2 * 5
    assert capsule(driven, "compare", "trials", "--plot", "moved.png").returncode == exit_codes.OK
    assert (driven / "moved.png").read_bytes().startswith(b"\x89PNG")
    assert capsule(driven, "compare", "trials", "--plot", "moved.pdf").returncode == exit_codes.USAGE


def test_what_cannot_be_drawn_is_an_error(driven: Path) -> None:
    for folder in (driven / "trials").iterdir():
        (folder / "bags/k3-pi_0.bag").write_text("no bag")
    ran = capsule(driven, "compare", "trials", "--plot", "moved.svg")
    assert ran.returncode == exit_codes.ERROR
    assert "EXPERIMENT" in ran.stdout
    assert ran.stderr.count("k3-pi_0.bag is not read: it is damaged, or no bag") == 5
    assert "no bag has a topic of odometry" in ran.stderr
    assert not (driven / "moved.svg").exists()


def rows(file: Path) -> list[dict[str, str]]:
    with file.open(encoding="utf-8", newline="") as lines:
        return list(csv.DictReader(lines))


def test_trials_and_samples_are_exported(driven: Path) -> None:
    ran = capsule(driven, "export", "trials", "--out", "made/tables")
    assert (ran.returncode, ran.stdout, ran.stderr) == (exit_codes.OK, "", "")
    trials = rows(driven / "made/tables/trials.csv")
    assert [(one["trial"], one["success"], one["wander.speed"]) for one in trials] == [
        ("0", "True", "0.1"), ("1", "False", "0.1"),
        ("2", "False", "0.2"), ("3", "False", "0.2"), ("4", "True", "0.2"),
    ]  # fmt: skip
    assert [one["k3/odom reached"] for one in trials] == ["0.02", "0.5", "", "", "0.02"]
    samples = rows(driven / "made/tables/samples.csv")
    assert len(samples) == 5 * 2 * 3
    assert samples[-1] == {
        "folder": "trials/circle-4", "topic": "/k3/odom", "t": "1.5", "x": str(0.2 * 1.5), "y": "0.0",
        "yaw": "0.0", "speed": "0.2",
    }  # fmt: skip


def test_damage_costs_its_bag_or_trial_alone(driven: Path) -> None:
    (driven / "trials/circle-0" / INDEX).write_text("{")
    (driven / "trials/circle-1/bags/k3-pi_1.bag").write_text("no bag")
    ran = capsule(driven, "export", "trials", "--out", "tables")
    assert ran.returncode == exit_codes.ERROR
    assert "error: trials/circle-0/index.json is not an index: Invalid JSON" in ran.stderr
    assert "error: trials/circle-1/bags/k3-pi_1.bag is not read: it is damaged, or no bag" in ran.stderr
    assert (len(rows(driven / "tables/trials.csv")), len(rows(driven / "tables/samples.csv"))) == (4, 24)
    compared = capsule(driven, "compare", "trials", "--json")
    assert compared.returncode == exit_codes.ERROR
    assert list(json.loads(compared.stdout)["errors"]) == ["trials/circle-0"]


def test_a_place_that_cannot_be_written_is_an_error(driven: Path) -> None:
    (driven / "file").touch()
    for words in (["export", "trials", "--out", "file"], ["compare", "trials", "--plot", "file/a.svg"]):
        ran = capsule(driven, *words)
        assert ran.returncode == exit_codes.ERROR
        assert "error: cannot write file" in ran.stderr


@pytest.mark.parametrize("library", ["pandas", "rosbags", "matplotlib"])
def test_a_missing_library_is_named(driven: Path, library: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, library, None)
    needs = {"pandas": ["export"], "matplotlib": ["compare"]}.get(library, ["export", "compare"])
    for verb in needs:
        more = ["--out", "tables"] if verb == "export" else ["--plot", "a.svg"]
        ran = capsule(driven, verb, "trials", *more)
        assert ran.returncode == exit_codes.USAGE
        assert f"needs {library}, which is not installed" in ran.stderr
        assert "pip install 'swarmctl[experiments]'" in ran.stderr
    assert capsule(driven, "compare", "trials").returncode == exit_codes.OK


def test_a_table_needs_no_library_of_an_extra(driven: Path) -> None:
    code = """
import sys
from swarmctl.cli.app import run
run(["capsule", "compare", "trials"])
run(["--help"])
assert not {"matplotlib", "numpy", "pandas", "rosbags"} & set(sys.modules)
"""
    subprocess.run([sys.executable, "-c", code], cwd=driven, check=True, stdout=subprocess.DEVNULL)
