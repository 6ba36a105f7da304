"""What ``deploy``, ``prepare`` and ``remove`` show while they run, on terminals of all kinds."""

from __future__ import annotations

import io
import sys
from collections.abc import Iterator

import pytest

from swarmctl.cli import console, rollout_output
from swarmctl.deploy.outcome import Removed
from swarmctl.remote.parallel_hosts import Event, Finished, Note, Started
from tests.cli.test_width import Terminal

HOST = "tb3-01"


def events() -> Iterator[Event[Removed]]:
    yield Started(HOST)
    yield Note(HOST, "stopping 4 units")
    yield Finished(HOST, Removed(changed=True), 2.6)


@pytest.fixture(autouse=True)
def consoles(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "50")
    console._console.cache_clear()
    yield
    console._console.cache_clear()


@pytest.mark.parametrize("stderr", [Terminal(), io.StringIO()], ids=["terminal", "file"])
def test_without_a_cursor_each_event_is_a_line(stderr: io.StringIO, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "dumb")
    monkeypatch.setattr(sys, "stderr", stderr)
    found = rollout_output.results(events(), [HOST], quiet=False)
    assert found == {HOST: Removed(changed=True)}
    assert stderr.getvalue().splitlines() == [
        f"{HOST}: connecting",
        f"{HOST}: stopping 4 units",
        f"{HOST}: removed  (2.6 s)",
    ]


def test_a_note_about_progress_ends_its_lines_at_blanks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(sys, "stderr", stderr := Terminal())
    note = "finishing the hosts in progress; after Ctrl-C again they finish or roll back on their own"
    rollout_output.note(note)
    shown = stderr.getvalue().splitlines()
    assert max(map(len, shown)) <= 50
    assert " ".join(map(str.strip, shown)) == note
