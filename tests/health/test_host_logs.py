"""The log of a host: by the operator's clock, and over links that get lost without loss or doubles."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any

import pytest

from swarmctl.health import host_logs
from swarmctl.health.host_logs import HostLog, HostReader, Question
from swarmctl.remote.transport import HostError, Kind, Target
from tests.timing import PATIENCE

NOW, AHEAD = 1_000_000.0, 3600.0  # s
QUESTION = Question("s", {"pi": ["k3"]}, 200, NOW - 10)
LOST = HostError(Kind.LOST, "lost")


class Host:
    """An agent on a host whose clock is ahead; its journal grows by an entry before each look at it."""

    def __init__(self, breaks: Mapping[int, HostError] | None = None) -> None:
        self.requests: list[Mapping[str, Any]] = []
        self.journal: list[float] = []
        self.breaks = dict(breaks or {})  # by number of entries in the journal

    def request(
        self,
        request: Mapping[str, Any],
        payload: bytes = b"",
        *,
        on_note: Callable[[str], None] | None = None,
        timeout: float = 60.0,
    ) -> Any:
        self.requests.append(request)
        if request["follow"]:
            assert on_note is not None
            for _ in range(3):
                self._grow()
                on_note(json.dumps(self._answer(int(request["after"]))))
                request = {**request, "after": str(len(self.journal))}
            return self._answer(len(self.journal))
        if request["lines"]:
            self._grow()
            return self._answer(0)
        return self._answer(len(self.journal))

    def _grow(self) -> None:
        self.journal.append(NOW + AHEAD + len(self.journal))
        if error := self.breaks.pop(len(self.journal), None):
            raise error

    def _answer(self, after: int) -> dict[str, Any]:
        entries = [
            {"time": at, "unit": "swarm-s.k3.service", "priority": 6, "message": "m"}
            for at in self.journal[after:]
        ]
        return {"clock": NOW + AHEAD, "entries": entries, "cursor": str(len(self.journal)), "cut": False}


@pytest.fixture(autouse=True)
def _clock(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(host_logs.time, "time", lambda: NOW)


def test_the_boundary_and_the_times_are_by_the_operators_clock() -> None:
    host = Host()
    found = HostReader(QUESTION, "pi").last(host)
    assert host.requests[-1]["since"] == NOW - 10 + AHEAD
    assert (host.requests[-1]["lines"], host.requests[-1]["parts"]) == (200, ["k3"])
    assert ([entry.time for entry in found.entries], found.offset) == ([NOW], AHEAD)


def followed(host: Host, pauses: int) -> tuple[list[HostLog | HostError], list[float]]:
    """What a reader shows until its last pause, and its pauses."""
    shown: list[HostLog | HostError] = []
    slept: list[float] = []

    reader = HostReader(QUESTION, "pi")

    def pause() -> float | None:
        with pytest.raises(HostError) as error:
            reader.follow(host, shown.append)
        shown.append(error.value)
        return reader.failed(error.value)

    while len(slept) < pauses and (seconds := pause()) is not None:
        slept.append(seconds)
    return shown, slept


def test_a_lost_link_goes_on_without_loss_or_doubles() -> None:
    host = Host({3: LOST, 9: LOST, 12: LOST, 14: LOST})
    shown, _ = followed(host, 4)
    times = [entry.time for one in shown if isinstance(one, HostLog) for entry in one.entries]
    assert times == [NOW + number for number in range(13)]
    assert [one for one in shown if isinstance(one, HostError)] == [LOST] * 4


def test_pauses_grow_to_10_s_until_a_round_is_whole() -> None:
    host = Host({1: LOST, 2: LOST, 3: LOST, 4: LOST, 5: LOST, 6: LOST, 20: LOST})
    assert followed(host, 7)[1] == [1.0, 2.0, 4.0, 8.0, 10.0, 10.0, 1.0]


def test_an_error_that_stays_ends_it() -> None:
    refused = HostError(Kind.PRIVILEGE, "no root")
    assert followed(Host({1: refused}), 1) == ([refused], [])


@pytest.mark.parametrize("note", ["{", "[]", '{"clock": 1}'])
def test_a_note_that_is_no_log_is_an_error(note: str) -> None:
    class Wrong(Host):
        def request(self, request: Mapping[str, Any], *args: Any, **more: Any) -> Any:
            if request["follow"]:
                more["on_note"](note)
            return super().request(request, *args, **more)

    shown, _ = followed(Wrong(), 1)
    assert isinstance(shown[-1], HostError)
    assert shown[-1].kind is Kind.PROTOCOL


def test_a_bug_is_an_error_of_its_host() -> None:
    class Broken:
        def connect(self, target: Target) -> Any:
            raise KeyError("x")

    found = host_logs.followed(QUESTION, [Target("pi", "192.0.2.1", "robot")], Broken())  # type: ignore[arg-type]
    host, error = found.get(timeout=PATIENCE)
    assert (host, str(error)) == ("pi", "pi: KeyError: 'x'; this is a bug in swarmctl")
