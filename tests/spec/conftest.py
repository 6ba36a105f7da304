"""How many hostile inputs and failing specs were run stands at the end of every test run that had some."""

from __future__ import annotations

import pytest

_RUN: list[str] = []
_REFUSED: list[str] = []


@pytest.fixture
def counted() -> list[str]:
    """Where each test notes its inputs."""
    return _RUN


@pytest.fixture
def refused() -> list[str]:
    """Where the failing specs are noted."""
    return _REFUSED


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    if _RUN:
        terminalreporter.write_line(f"hostile inputs run: {len(_RUN)}")
    if _REFUSED:
        terminalreporter.write_line(f"failing specs: {len(_REFUSED)}")
