"""Fixtures for every folder of tests: golden files, figures, and the folders of the repository.

Golden files are written anew by ``pytest --regenerate``; read the difference before committing it.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from tests import ROOT
from tests.timing import Promise

MEASURED = "measured"
_RUN: list[str] = []


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--regenerate", action="store_true", help="write golden files anew instead of comparing")
    parser.addoption("--bars", action="store_true", help="run the tests of promised times; fail over a bar")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if config.getoption("--bars"):
        items[:] = [item for item in items if "promise" in getattr(item, "fixturenames", ())]


def pytest_configure() -> None:
    """Let programs under test receive signals ignored around us; give Hypothesis no limit of real time.

    No verb leaves a process that keeps its connections, but where a test is about that.

    A script's background job ignores Ctrl-C, `nohup` a hangup, and so would every process started here: a
    handler is not inherited, an ignored signal is.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
        signal.signal(signal.SIGHUP, lambda *_: None)
    os.environ["SWARMCTL_NO_REUSE"] = "1"
    settings.register_profile("busy", settings(), deadline=None, suppress_health_check=[HealthCheck.too_slow])
    settings.load_profile("busy")


@pytest.fixture(autouse=True)
def no_ci(monkeypatch: pytest.MonkeyPatch) -> None:
    """What swarmctl prints follows the CI that it runs in; the tests' own CI is not meant."""
    for name in ("GITHUB_ACTIONS", "GITHUB_STEP_SUMMARY", "GITHUB_WORKSPACE", "CI_PROJECT_DIR"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture
def note(request: pytest.FixtureRequest) -> Callable[[str, str, str], None]:
    """Keep a figure for the table at the end: what, value, bar."""
    figures = request.node.user_properties
    return lambda what, value, bar: figures.append((MEASURED, (what, value, bar)))


@pytest.fixture
def promise(request: pytest.FixtureRequest, note: Callable[[str, str, str], None]) -> Promise:
    """Keep a time that swarmctl promises for the table at the end: what, its seconds, its bar in s.

    Only ``pytest --bars``, a part of ``make bench``, fails if it is over the bar.
    """

    def check(what: str, seconds: float, bar: float) -> None:
        note(what, f"{seconds:.2f} s", f"<= {bar:g} s{' MISSED' * (seconds > bar)}")
        assert seconds <= bar or not request.config.getoption("--bars"), what

    return check


@pytest.fixture
def counted() -> list[str]:
    """Where tests note their hostile inputs; the number stands at the end of the run."""
    return _RUN


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """The figures that tests kept; reports carry them here also from other processes."""
    reports = [*terminalreporter.getreports("passed"), *terminalreporter.getreports("failed")]
    kept = (value for report in reports for name, value in report.user_properties if name == MEASURED)
    figures = list(dict.fromkeys(tuple(value) for value in kept))
    if figures:
        terminalreporter.section("measured")
        width = max(len(what) for what, _, _ in figures)
        wide = max(len(value) for _, value, _ in figures)
        for what, value, bar in figures:
            terminalreporter.write_line(f"{what:<{width}}  {value:>{wide}}  {bar}".rstrip())
    if _RUN:
        terminalreporter.write_line(f"hostile inputs run: {len(_RUN)}")


@pytest.fixture
def golden(request: pytest.FixtureRequest) -> Callable[[Path, str], None]:
    """Compare a text with a golden file, or write it with ``--regenerate``."""

    def check(file: Path, text: str) -> None:
        if request.config.getoption("--regenerate"):
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text, "utf-8")
            return
        assert file.is_file(), f"{file.relative_to(ROOT)} is missing: run pytest --regenerate and read it"
        assert text == file.read_text("utf-8")

    return check


@pytest.fixture
def regenerating(request: pytest.FixtureRequest) -> bool:
    return bool(request.config.getoption("--regenerate"))


@pytest.fixture
def root() -> Path:
    """The top of the repository."""
    return ROOT


@pytest.fixture
def leader_spec(root: Path) -> Path:
    """The example of the first paper: a Koala's laptop leads a Khepera III and an e-puck."""
    return root / "examples/paper-leader/swarm.yaml"
