"""How many hostile inputs were run stands at the end of every test run that had some."""

from __future__ import annotations

import pytest

_RUN: list[str] = []


@pytest.fixture
def counted() -> list[str]:
    """Where each test notes its inputs."""
    return _RUN


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    if _RUN:
        terminalreporter.write_line(f"hostile inputs run: {len(_RUN)}")
