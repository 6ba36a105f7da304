"""``python -m tests.run``: every test, in two parts; each file with a failure is run once more, alone.

Its tests may share a lab, and build on each other. A test that fails then as well fails the run, and so do
more than `MOST_ALONE` files. Tests that pass only alone are listed and added to ``build/alone.txt``, with the
commit. ``build/tested`` is the commit of the last run of all tests that passed.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import pytest

MOST_ALONE = 15
_RAN = (pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED, pytest.ExitCode.NO_TESTS_COLLECTED)


@dataclass
class Outcomes:
    """What became of the tests; ``skipped`` has the reason of each."""

    passed: set[str] = field(default_factory=set)
    failed: set[str] = field(default_factory=set)
    skipped: dict[str, str] = field(default_factory=dict)
    complete: bool = True  # all tests were collected, and pytest ended by itself

    def read(self, reports: Iterable[dict[str, object]]) -> None:
        """Add the reports of pytest-reportlog: of each test one for its setup, its call and its teardown."""
        for report in reports:
            test, outcome = str(report.get("nodeid")), report.get("outcome")
            if outcome == "failed":
                self.failed.add(test)
                self.complete &= report["$report_type"] == "TestReport"
            elif outcome == "skipped" and report["$report_type"] == "TestReport":
                self.skipped[test] = _reason(report.get("longrepr"))
            elif report.get("when") == "call":
                self.passed.add(test)
        self.passed -= self.failed

    def failed_by_file(self) -> dict[str, set[str]]:
        """The tests that failed, by file."""
        found: dict[str, set[str]] = {}
        for test in sorted(self.failed):
            found.setdefault(test.partition("::")[0], set()).add(test)
        return found


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--workers", type=int, default=0, help="processes for the tests without the lab")
    parser.add_argument("--labs", type=int, default=0, help="processes for the tests in the lab")
    parser.add_argument("--all", action="store_true", help="the tests with the mark `slow` as well")
    given, rest = parser.parse_known_args(arguments)
    these = "" if given.all else " and not slow"
    fast = ["-m", f"not lab{these}", "-n", str(given.workers), "--dist", "worksteal"]
    lab = ["-m", f"lab{these}", "-n", str(given.labs), "--dist", "loadfile", "--no-loadscope-reorder"]
    outcomes, commit = Outcomes(), _clean_commit()
    for part in (fast, lab):
        _run([*part, *rest], outcomes)
    alone: set[str] = set()
    if len(files := outcomes.failed_by_file()) <= MOST_ALONE:
        for file, tests in files.items():
            again = Outcomes()
            print("== once more, alone:", file, flush=True)
            _run([file, *([] if given.all else ["-m", "not slow"])], again)
            if again.complete and again.passed >= tests:
                alone |= tests
            outcomes.failed |= again.failed
    outcomes.failed -= alone
    outcomes.passed = (outcomes.passed | alone) - outcomes.failed
    green = outcomes.complete and bool(outcomes.passed) and not outcomes.failed
    _keep(alone, commit if green and not rest else "")
    print("\n".join(_summary(outcomes, alone)), flush=True)
    return 0 if green else 1


def _run(options: Sequence[str], outcomes: Outcomes) -> None:
    with tempfile.NamedTemporaryFile(suffix=".jsonl") as log:
        argv = [sys.executable, "-m", "pytest", f"--report-log={log.name}", *options]
        status = subprocess.run(argv, check=False).returncode
        outcomes.read(map(json.loads, Path(log.name).read_text("utf-8").splitlines()))
    outcomes.complete &= status in _RAN


def _reason(longrepr: object) -> str:
    text = longrepr[-1] if isinstance(longrepr, list) else longrepr
    return str(text).removeprefix("Skipped: ")


def _keep(alone: set[str], passed: str) -> None:
    """Note what passed only alone, and the commit that ``passed``, if it is still the one that is here."""
    build = Path("build")
    build.mkdir(exist_ok=True)
    with (build / "alone.txt").open("a", encoding="utf-8") as file:
        file.writelines(f"{_git('rev-parse', 'HEAD')} {test}\n" for test in sorted(alone))
    if passed and passed == _clean_commit():
        (build / "tested").write_text(f"{passed}\n", "utf-8")


def _clean_commit() -> str:
    """The commit that is checked out; nothing if files differ from it."""
    return "" if _git("status", "--porcelain") else _git("rev-parse", "HEAD")


def _git(*arguments: str) -> str:
    return subprocess.run(("git", *arguments), capture_output=True, text=True, check=False).stdout.strip()


def _summary(outcomes: Outcomes, alone: set[str]) -> list[str]:
    causes = Counter(outcomes.skipped.values()).most_common()
    return [
        "",
        *(["skipped"] if causes else []),
        *(f"  {count:4} {cause}" for cause, count in causes),
        *(["passed only alone"] if alone else []),
        *(f"  {test}" for test in sorted(alone)),
        *(["failed"] if outcomes.failed else []),
        *(f"  {test}" for test in sorted(outcomes.failed)),
        *([] if outcomes.complete else ["not all tests were run"]),
        f"{len(outcomes.passed)} passed, {len(outcomes.failed)} failed, {len(outcomes.skipped)} skipped",
    ]


if __name__ == "__main__":
    sys.exit(main())
