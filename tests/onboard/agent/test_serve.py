"""One agent answers request after request; what ends it, and what does not."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import pytest

from tests.onboard.agent.fakehost import (
    BOOT,
    FakeHost,
    bundle,
    decode,
    payload_of,
    request_for,
)
from tests.timing import PATIENCE

OBSERVE = {"verb": "observe", "swarm": "new"}
RELEASE = bundle("1")


@contextmanager
def serving(host: FakeHost, boot: str = BOOT) -> Iterator[subprocess.Popen[bytes]]:
    """An agent that waits for its next request."""
    with subprocess.Popen(
        [sys.executable, "-I", "-S", "-c", boot],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env=host.environment(),
        bufsize=0,
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def send(process: subprocess.Popen[bytes], request: Mapping[str, Any], payload: bytes = b"") -> None:
    assert process.stdin is not None
    process.stdin.write(json.dumps({**request, "payload": len(payload)}).encode() + b"\n" + payload)


def next_line(process: subprocess.Popen[bytes]) -> dict[str, Any]:
    """The next line that is no note; empty at the end."""
    assert process.stdout is not None
    while line := process.stdout.readline():
        if line.strip() and "note" not in (data := decode(line.strip())):
            return data
    return {}


def test_requests_are_answered_until_the_input_ends(host: FakeHost) -> None:
    with serving(host) as process:
        send(process, OBSERVE)
        assert next_line(process)["answer"]["release"] is None
        send(process, request_for(RELEASE), payload_of(RELEASE))
        send(process, OBSERVE)
        assert next_line(process)["answer"]["release"] == RELEASE.digest
        assert next_line(process)["answer"]["release"] == RELEASE.digest
        assert process.stdin is not None
        process.stdin.close()
        assert process.wait(PATIENCE) == 0
        assert next_line(process) == {}


def test_a_request_that_fails_does_not_end_the_agent(host: FakeHost) -> None:
    with serving(host) as process:
        for wrong, kind in (
            (request_for(RELEASE, previous="0" * 16), "refused"),
            ({"verb": "no"}, "protocol"),
        ):
            send(process, wrong, payload_of(RELEASE))
            assert next_line(process)["error"]["kind"] == kind
        send(process, OBSERVE)
        assert next_line(process)["answer"]["release"] is None


@pytest.mark.parametrize(
    "sent", [b"{broken\n", b"[]\n", b'{"verb": "observe"}', b'{"payload": -1}\n', b'{"payload": 9}\nshort']
)
def test_what_is_no_request_ends_the_agent(host: FakeHost, sent: bytes) -> None:
    with serving(host) as process:
        assert process.stdin is not None
        process.stdin.write(sent)
        if not sent.endswith(b"\n"):
            process.stdin.close()
        assert "error" in next_line(process)
        assert process.wait(PATIENCE) == 0


def test_a_silent_operator_is_given_up_on_between_two_requests(host: FakeHost) -> None:
    boot = BOOT.replace(
        "; serve(", "; import swarm_onboard.agent.rpc; swarm_onboard.agent.rpc.IDLE = 1; serve("
    )
    with serving(host, boot) as process:
        send(process, OBSERVE)
        assert "answer" in next_line(process)
        assert next_line(process)["error"]["message"] == "no data came for 1 s"
        assert process.wait(PATIENCE) == 0


def test_after_a_deploy_the_agent_can_be_ended_like_any_process(host: FakeHost) -> None:
    with serving(host) as process:
        send(process, request_for(RELEASE), payload_of(RELEASE))
        assert "answer" in next_line(process)
        send(process, OBSERVE)
        assert "answer" in next_line(process)
        process.send_signal(signal.SIGTERM)
        assert process.wait(PATIENCE) == -signal.SIGTERM


def test_nothing_changes_after_the_operator_has_left(host: FakeHost) -> None:
    with serving(host) as process:
        send(process, OBSERVE)
        next_line(process)
        assert process.stdout is not None
        process.stdout.close()
        send(process, request_for(RELEASE), payload_of(RELEASE))
        process.wait(PATIENCE)
    assert not os.path.lexists(host.prefix / "opt/swarm/new/current")
    assert host.calls() == []
