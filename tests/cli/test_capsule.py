"""``swarmctl capsule``: what is intact, what is not, and how many trials were completed."""

from __future__ import annotations

import json
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from swarmctl.capsule.capsule_index import INDEX, SIGNATURE
from swarmctl.capsule.folder import write
from swarmctl.capsule.signature import sign, signer
from swarmctl.cli import exit_codes
from tests.capsule.trial_folder import ABOUT, filled
from tests.in_process import swarmctl

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
