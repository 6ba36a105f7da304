"""``pytest -p tests.changed_first --within S``: what a change touches first, and nothing more after S s.

A folder of tests mirrors the package that it tests, so paths say which they are: first the tests that
changed and those named after a module that changed, then the rest of their folders, then everything else.
A change is what differs from the branch ``main``, committed or not; on ``main`` itself, the last commit.
"""

from __future__ import annotations

import re
import subprocess
import time
from pathlib import Path

import pytest

from tests import ROOT

#: Where the tests of a path are, if its folder has another name: the first that matches.
HOMES = (
    (r"swarmctl/([^/]+)/.*", r"tests/\1"),
    (r"templates/onboard/swarm_onboard/(?:nodes/)?([^/]+?)s?/.*", r"tests/onboard/\1"),
    (r"templates/(os|ros[12]?)/.*", "tests/host_scripts"),
    (r"templates/(robots|data)/.*", "tests/robot_types"),
    (r"templates/firmware/.*", "tests/firmware"),
    (r"benchmarks/.*", "tests/benchmarks"),
    (r"examples/.*", "tests/render"),
    (r"(?:README|CHANGELOG|CONTRIBUTING)\.md|docs/.*", "tests/test_pages.py"),
    (r"(tests/(?:packages/|lab/emulators)?[^/]+)/.*", r"\1"),
)
#: They take long and rarely fail, so they come last.
SLOW = ("tests/ci", "tests/conformance", "tests/benchmarks", "tests/firmware", "tests/editors")
NOT_RUN = "the time is up"


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--within", type=float, default=90.0, help="seconds after which no test is begun")


def pytest_configure(config: pytest.Config) -> None:
    config.stash[BEGAN] = time.monotonic()


BEGAN = pytest.StashKey[float]()


def changed() -> list[str]:
    """Return the paths that differ from main, or that the last commit changed."""
    base = git("merge-base", "HEAD", "main").strip() or "HEAD"
    paths = git("diff", "--name-only", base) + git("ls-files", "--others", "--exclude-standard")
    return (paths or git("diff", "--name-only", "HEAD~1")).split()


def git(*arguments: str) -> str:
    return subprocess.run(("git", *arguments), cwd=ROOT, capture_output=True, text=True, check=False).stdout


def home_of(path: str) -> str:
    """Return the folder or file of the tests of ``path``, or nothing."""
    for pattern, home in HOMES:
        if match := re.fullmatch(pattern, path):
            return match.expand(home)
    return ""


def rank(test: str, paths: list[str]) -> int:
    """Return the place of a file of tests: 0 is first."""
    homes = {home_of(path) for path in paths} - {""}
    if test in paths or any(Path(test).stem == f"test_{Path(path).stem}" for path in paths):
        return 0
    if any(test == home or test.startswith(f"{home}/") for home in homes):
        return 1
    return 3 if test.startswith(SLOW) else 2


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    paths = changed()
    files = {item.path: rank(str(item.path.relative_to(ROOT)), paths) for item in items}
    items.sort(key=lambda item: files[item.path])


def pytest_runtest_setup(item: pytest.Item) -> None:
    if time.monotonic() - item.config.stash[BEGAN] > item.config.getoption("--within"):
        pytest.skip(NOT_RUN)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    skipped = [report for report in terminalreporter.getreports("skipped") if NOT_RUN in str(report.longrepr)]
    if skipped:
        files = sorted({report.nodeid.partition("::")[0] for report in skipped})
        terminalreporter.section(f"{len(skipped)} tests were not begun: {NOT_RUN}; make test runs them")
        terminalreporter.write_line(" ".join(file.removeprefix("tests/") for file in files))
