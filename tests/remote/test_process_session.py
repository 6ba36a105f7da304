"""Commands of a session that are processes of this machine: their answers, limits and ends."""

from __future__ import annotations

import os

import pytest

from swarmctl.remote.process_session import ProcessSession
from swarmctl.remote.transport import HostError, Kind
from tests.timing import PATIENCE, wait_for

SESSION = ProcessSession(("env", "SIDE=inside"), dict(os.environ))


def test_a_command_answers_one_exchange_after_the_other() -> None:
    with SESSION.channel('while read line; do echo "$SIDE $line"; done; echo why >&2; exit 3') as channel:
        for word in (b"one", b"two"):
            answer = channel.exchange([word, b"\n"], lambda piece: piece.endswith(b"\n"))
            assert (answer.status, answer.stdout) == (None, b"inside " + word + b"\n")
    with SESSION.channel("echo why >&2; exit 3") as channel:
        done = channel.exchange([b"nobody reads this"], lambda _: False)
        assert (done.status, done.stdout, done.stderr) == (3, b"", b"why\n")


@pytest.mark.parametrize(
    ("command", "timeout", "kind"),
    [("exec yes", PATIENCE, Kind.PROTOCOL), ("exec sleep infinity", 0.2, Kind.LOST)],
)
def test_a_command_that_does_not_end_is_killed(command: str, timeout: float, kind: Kind) -> None:
    with SESSION.channel(command, limit=1000) as channel:
        with pytest.raises(HostError) as raised:
            channel.exchange([], lambda _: False, timeout=timeout)
        process = channel._process
        assert process is not None
        wait_for(lambda: process.poll() is not None)  # before the channel is closed
    assert raised.value.kind is kind
