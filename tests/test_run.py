"""How `make test` treats failures: those that pass alone are listed, those that fail again fail the run."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from tests import ROOT
from tests.run import MOST_ALONE

PASSES = "def test_passes(): pass\n"
FAILS = "def test_fails(): assert False\n"
SKIPS = "import pytest\n@pytest.mark.skip(reason='no npm')\ndef test_skips(): pass\n"
#: Fails in its first run only, as beside another test.
FLAKY = """
from pathlib import Path
import pytest
@pytest.mark.parametrize("name", range({count}))
def test_flaky(name):
    mark = Path(__file__).with_suffix(f".{{name}}")
    seen = mark.exists()
    mark.touch()
    assert seen
"""
#: Its tests build on the first; the second fails in its first run only.
STEPS = """
from pathlib import Path
done = []
def test_first(): done.append(1)
def test_second():
    assert done
    mark = Path(__file__).with_suffix(".0")
    seen = mark.exists()
    mark.touch()
    assert seen
"""
LAB = "import pytest\n@pytest.mark.lab\ndef test_lab(): pass\n"


def ran(folder: Path, *options: str, **files: str) -> tuple[int, list[str]]:
    """Run the tests of ``files`` in a repository of their own. Return the status and the lines of the end."""
    (folder / "pytest.ini").write_text("[pytest]\naddopts = -p no:cacheprovider\nmarkers = lab\n", "utf-8")
    (folder / ".gitignore").write_text("build\n__pycache__\n*.[0-9]\n", "utf-8")
    for name, code in files.items():
        (folder / f"test_{name}.py").write_text(code, "utf-8")
    for words in (
        ["init", "-q"],
        ["add", "."],
        ["-c", "user.name=x", "-c", "user.email=x", "commit", "-qmx"],
    ):
        subprocess.run(["git", *words], cwd=folder, check=True)
    run = subprocess.run(
        [sys.executable, "-m", "tests.run", *options],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    return run.returncode, run.stdout.splitlines()


def test_what_passes_alone_is_listed_and_kept(tmp_path: Path) -> None:
    status, lines = ran(tmp_path, passes=PASSES, flaky=FLAKY.format(count=2), lab=LAB, skips=SKIPS)
    assert status == 0
    assert lines[-1] == "4 passed, 0 failed, 1 skipped"
    assert lines[-6:-1] == [
        "skipped",
        "     1 no npm",
        "passed only alone",
        "  test_flaky.py::test_flaky[0]",
        "  test_flaky.py::test_flaky[1]",
    ]
    commit = (tmp_path / "build/tested").read_text("utf-8").strip()
    alone = (tmp_path / "build/alone.txt").read_text("utf-8")
    assert alone.splitlines()[0] == f"{commit} test_flaky.py::test_flaky[0]"


def test_a_file_is_run_once_more_as_a_whole(tmp_path: Path) -> None:
    status, lines = ran(tmp_path, passes=PASSES, steps=STEPS, lab=LAB)
    assert status == 0
    assert lines[-1] == "4 passed, 0 failed, 0 skipped"
    assert "  test_steps.py::test_second" in lines


def test_what_fails_only_then_fails_the_run(tmp_path: Path) -> None:
    turned = "assert seen", "assert not seen"
    later = FLAKY.format(count=1).replace("test_flaky", "test_later").replace(*turned)
    status, lines = ran(tmp_path, both=FLAKY.format(count=1) + later.replace('f".{name}"', '".9"'))
    assert status == 1
    assert lines[-2:] == ["  test_both.py::test_later[0]", "1 passed, 1 failed, 0 skipped"]


def test_what_fails_again_fails_the_run_after_both_parts(tmp_path: Path) -> None:
    status, lines = ran(tmp_path, passes=PASSES, fails=FAILS, lab=LAB)
    assert status == 1
    assert lines[-3:] == ["failed", "  test_fails.py::test_fails", "2 passed, 1 failed, 0 skipped"]
    assert not (tmp_path / "build/tested").exists()


def test_many_that_would_pass_alone_fail_the_run(tmp_path: Path) -> None:
    many = {f"flaky{number}": FLAKY.format(count=1) for number in range(MOST_ALONE + 1)}
    status, lines = ran(tmp_path, passes=PASSES, **many)
    assert status == 1
    assert lines[-1] == f"1 passed, {MOST_ALONE + 1} failed, 0 skipped"


def test_what_cannot_be_imported_fails_the_run(tmp_path: Path) -> None:
    status, lines = ran(tmp_path, passes=PASSES, broken="import nothing_of_that_name\n")
    assert status == 1
    assert "not all tests were run" in lines


def test_a_run_of_some_tests_is_no_run_of_all(tmp_path: Path) -> None:
    status, _ = ran(tmp_path, "test_passes.py", passes=PASSES, lab=LAB)
    assert status == 0
    assert not (tmp_path / "build/tested").exists()


def test_a_run_of_no_test_is_no_success(tmp_path: Path) -> None:
    assert ran(tmp_path, passes="")[0] == 1
