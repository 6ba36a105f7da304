"""The verb ``logs``: reads the journal of the swarm's units, within limits, and follows it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from swarm_onboard.agent.verbs import logs

from swarmctl.remote import agent_client
from swarmctl.remote.answer_check import checked, of_note
from swarmctl.remote.ask import ask
from tests.onboard.agent.fakehost import FakeHost
from tests.onboard.agent.local_session import LocalSession
from tests.timing import wait_for

UNITS = ("swarm-s.k3.service", "swarm-s.k3.gate.service", "swarm-s.k30.service", "swarm-other.k3.service")
REQUEST = logs.Request("s", [], lines=3)


def line(at: float, message: Any = "m") -> str:
    fields = {"__CURSOR": f"c{at:g}", "__REALTIME_TIMESTAMP": str(int(at * 1e6)), "_SYSTEMD_UNIT": UNITS[0]}
    return json.dumps({**fields, "MESSAGE": message})


@pytest.fixture
def host(tmp_path: Path) -> FakeHost:
    made = FakeHost(tmp_path / "host")
    for unit in UNITS:
        (made.prefix / "etc/systemd/system" / unit).touch()
    return made


def journal(host: FakeHost, lines: Sequence[str], then: str = "") -> None:
    """A journalctl that prints these lines, and notes how it was called."""
    (host.prefix / "journal").write_text("".join(f"{one}\n" for one in lines))
    path = host.prefix / "bin/journalctl"
    path.write_text(f'#!/bin/sh\necho "$*" >> {host.prefix}/calls\ncat {host.prefix}/journal\n{then}\n')
    path.chmod(0o755)


def logged(host: FakeHost, **changes: Any) -> Any:
    reply = host.ask({"verb": "logs", **REQUEST._replace(**changes)._asdict()})
    return checked(reply.answer, logs.Answer, "it") if reply.answer else reply.error


def test_the_last_lines_come_oldest_first(host: FakeHost) -> None:
    journal(host, ["-- Boot --", *(line(at) for at in (5, 4, 3, 2))])
    answer = logged(host)
    assert [entry.time for entry in answer.entries] == [3, 4, 5]
    assert (answer.cursor, answer.cut) == ("c5", True)
    assert not logged(host, lines=4).cut
    assert [entry.time for entry in logged(host, since=3.5).entries] == [4, 5]


@pytest.mark.parametrize(
    ("parts", "units"), [([], UNITS[:3]), (["k3"], UNITS[:2]), (["k30", "x"], UNITS[2:3])]
)
def test_only_the_units_that_are_meant_are_read(
    host: FakeHost, parts: list[str], units: Sequence[str]
) -> None:
    journal(host, [])
    logged(host, parts=parts)
    called = (host.prefix / "calls").read_text().split()
    assert {word for word in called if word.startswith("--unit")} == {f"--unit={unit}" for unit in units}


def test_a_host_without_such_units_reads_nothing(host: FakeHost) -> None:
    journal(host, [line(1)])
    assert logged(host, parts=["x"]).entries == []


def test_a_message_is_cut_and_bytes_are_text(host: FakeHost) -> None:
    journal(host, [line(2, "x" * 5000), line(1, [104, 105, 255])])
    short, long = logged(host).entries
    assert (short.message, len(long.message)) == ("hi\\xff", 4096)


def test_an_entry_about_a_unit_is_of_that_unit(host: FakeHost) -> None:
    """Whatever its process was, also one that journald found gone."""
    dump, other = json.loads(line(2)), json.loads(line(1))
    dump.update(COREDUMP_UNIT=UNITS[0], _SYSTEMD_UNIT="systemd-coredump@0.service")
    other["OBJECT_SYSTEMD_UNIT"] = other.pop("_SYSTEMD_UNIT")
    journal(host, [json.dumps(dump), json.dumps(other)])
    assert [(entry.time, entry.unit) for entry in logged(host).entries] == [
        (1, UNITS[0]),
        (2, UNITS[0]),
    ]


def test_a_flood_is_cut(host: FakeHost) -> None:
    journal(host, [line(at, "x" * 5000) for at in range(1100)])
    answer = logged(host, lines=10000)
    assert (len(answer.entries), answer.cut) == (1024, True)


def test_a_broken_journal_is_an_error(host: FakeHost) -> None:
    journal(host, [], then="exit 1")
    assert logged(host)["message"] == "journalctl ended with status 1"


def test_it_follows_from_the_cursor_until_units_come_or_go(host: FakeHost) -> None:
    # `exec`: the shell would leave `sleep` behind.
    journal(host, [line(1), line(2), '{"__CURS'], then="exec sleep 1000")
    notes: list[logs.Answer] = []

    def take(note: str) -> None:
        notes.append(of_note(note, logs.Answer, "it"))
        (host.prefix / "etc/systemd/system/swarm-s.new.service").touch()

    session = LocalSession(host.environment())
    with agent_client.agent_session(session, become=False, verbs=("logs",)) as agent:
        ask(agent, logs.handle, REQUEST._replace(after="c0", follow=1000.0), on_note=take)
    assert [(one.cursor, len(one.entries)) for one in notes] == [("c2", 2)]
    assert "--after-cursor=c0" in (host.prefix / "calls").read_text()


def test_it_ends_with_the_operator(host: FakeHost) -> None:
    journal(host, [line(1)], then=f"echo $$ > {host.prefix}/follower; exec sleep 1000")
    follower = host.prefix / "follower"

    def leave(note: str) -> None:
        wait_for(lambda: follower.exists() and follower.read_text().strip())
        raise KeyboardInterrupt

    session = LocalSession(host.environment())
    with (
        suppress(KeyboardInterrupt),
        agent_client.agent_session(session, become=False, verbs=("logs",)) as agent,
    ):
        ask(agent, logs.handle, REQUEST._replace(follow=1000.0), on_note=leave)
    process = Path(f"/proc/{follower.read_text().strip()}")
    wait_for(lambda: not process.exists(), complaint="journalctl stays")
