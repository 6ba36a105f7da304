"""The journal of a host: by the operator's clock, and bounded."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import pytest

from swarmctl.health import host_logs
from swarmctl.remote.transport import HostError, Kind, Output

NOW, AHEAD = 1_000_000.0, 3600.0  # s


class Host:
    """A session to a host whose clock is ahead, with this journal."""

    def __init__(self, journal: bytes, stderr: bytes = b"") -> None:
        self.journal, self.stderr, self.since, self.exchanges = journal, stderr, b"", 0

    @contextmanager
    def channel(self, command: str, *, limit: int = 1 << 20) -> Iterator[Host]:
        yield self

    def close(self) -> None:
        pass

    def exchange(
        self, stdin: Sequence[bytes], enough: Callable[[bytes], bool], *, timeout: float = 60.0
    ) -> Output:
        self.exchanges += 1
        if self.exchanges == 1:
            return Output(None, b"\n", b"")
        if self.exchanges == 2:
            return Output(None, b"%f\n" % (NOW + AHEAD), b"")
        self.since = b"".join(stdin)
        return Output(0, self.journal, self.stderr)


def line(at: float) -> bytes:
    fields = {
        "__REALTIME_TIMESTAMP": str(int(at * 1e6)),
        "_SYSTEMD_UNIT": "swarm-s.k3.service",
        "MESSAGE": "m",
    }
    return json.dumps(fields).encode() + b"\n"


def test_the_boundary_and_the_times_are_by_the_operators_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("swarmctl.health.host_logs.time.time", lambda: NOW)
    host = Host(line(NOW + AHEAD - 20) + line(NOW + AHEAD - 5))
    found = host_logs.host_log(host, "pi", "s", 200, NOW - 10)
    assert host.since == b"1003590\n"
    assert [entry.time for entry in found.entries] == [NOW - 5]


def test_more_than_was_asked_for_is_reported() -> None:
    assert host_logs.host_log(Host(line(1.0) * 3), "pi", "s", 3, 0.0).cut
    assert host_logs.host_log(Host(b"x" * host_logs.MOST_BYTES), "pi", "s", 3, 0.0).cut


def test_a_host_where_no_unit_has_logged_has_no_entries() -> None:
    host = Host(b"", b"Failed to add filter for units: No data available\n")
    assert host_logs.host_log(host, "pi", "s", 200, 0.0).entries == []


def test_a_host_without_sudo_is_an_error() -> None:
    with pytest.raises(HostError, match="a password is required") as caught:
        host_logs.host_log(Host(b"", b"sudo: a password is required\n"), "pi", "s", 200, 0.0)
    assert caught.value.kind is Kind.PRIVILEGE
