"""The guard between hosts at loopback addresses and a master: what passes, is refused, is bounded."""

from __future__ import annotations

import asyncio
import gc
import http.client
import socket
import threading
import xmlrpc.client
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from typing import Any
from xmlrpc.server import SimpleXMLRPCDispatcher

import pytest
from hypothesis import given
from hypothesis import strategies as st
from swarm_onboard.guard import proxy
from swarm_onboard.guard.config import parse
from swarm_onboard.guard.proxy import Journal, Proxy

from tests.onboard.guard.facts import EPUCK, K3, LAPTOP, OTHER, STRANGER, parameters
from tests.onboard.multimaster.masters import Rosmaster
from tests.ports import free_port
from tests.timing import PATIENCE, wait_for

TYPE = "std_msgs/String"


class Guarded:
    """A guard and its master, which is in memory.

    ``journal`` has what the guard wrote, ``errors`` what no code of the guard has caught.
    """

    def __init__(self, **changed: Any) -> None:
        self._changed = changed
        self.master, self.port, self.journal = Rosmaster(), free_port(), list[str]()
        self.errors = list[Any]()
        self._loop = asyncio.new_event_loop()
        self._loop.set_exception_handler(lambda _loop, what: self.errors.append(what))
        self._thread = threading.Thread(target=self._loop.run_forever)

    def __enter__(self) -> Guarded:
        master: Any = SimpleXMLRPCDispatcher(allow_none=True)
        master.register_multicall_functions()
        master.register_instance(self.master)
        self._thread.start()
        config = parse({**parameters(self.port), **self._changed})
        guard = Proxy(config, master._marshaled_dispatch, self.journal.append)
        listeners = [socket.create_server((place, self.port)) for place in config.places]
        asyncio.run_coroutine_threadsafe(guard.start(listeners), self._loop).result(PATIENCE)
        return self

    def __exit__(self, *_: object) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()

    def connected(self, source: str) -> socket.socket:
        return socket.create_connection((LAPTOP, self.port), PATIENCE, source_address=(source, 0))

    def called(self, source: str, method: str, *arguments: Any) -> Any:
        """The answer to a call from ``source``."""
        connection = http.client.HTTPConnection(LAPTOP, self.port, PATIENCE, (source, 0))
        try:
            connection.request("POST", "/RPC2", xmlrpc.client.dumps(arguments, method, allow_none=True))
            return xmlrpc.client.loads(connection.getresponse().read())[0][0]
        finally:
            connection.close()

    def raw(self, source: str, data: bytes) -> bytes:
        """What the guard sends to what sends ``data`` and ends."""
        with self.connected(source) as one, suppress(OSError):
            one.sendall(data)
            one.shutdown(socket.SHUT_WR)
            return b"".join(iter(lambda: one.recv(1 << 16), b""))
        return b""


@pytest.fixture(scope="module")
def guarded() -> Iterator[Guarded]:
    with Guarded() as one:
        yield one


def posted(body: bytes, size: int | None = None) -> bytes:
    return b"POST / HTTP/1.1\r\nContent-Length: %d\r\n\r\n" % (len(body) if size is None else size) + body


def test_what_is_permitted_reaches_the_master(guarded: Guarded) -> None:
    uri = f"http://{K3}:4000/"
    assert guarded.called(K3, "registerPublisher", "/k3/driver", "/k3/odom", TYPE, uri) == [1, "", []]
    assert ("/k3/odom", "/k3/driver", uri) in guarded.master.publishers()


def test_a_hub_that_is_called_by_its_name_reaches_it_under_that() -> None:
    """Its own name is 127.0.1.1 to a host of Debian."""
    with Guarded(uri="http://laptop:11311", places=["127.0.1.1"]) as one:
        master = xmlrpc.client.ServerProxy(f"http://127.0.1.1:{one.port}")
        assert master.getUri("/x") == [1, "", "http://laptop:11311"]


def test_what_is_refused_does_not_and_is_in_the_journal(guarded: Guarded) -> None:
    code, reason, _ = guarded.called(K3, "setParam", "/x", "/run_id", "mine")
    assert code == -1
    assert "set by the master's host" in reason
    assert "/run_id" not in guarded.master.parameters
    line = f"refused: setParam /x /run_id from {K3} (k3-pi): /run_id is set by the master's host"
    assert line in guarded.journal


@pytest.mark.parametrize("value", ["<a>&\r\n\tä", 1.5, True, -7, [], {"x": [1, {"y": "z"}]}], ids=repr)
def test_values_arrive_as_they_were_sent(value: Any, guarded: Guarded) -> None:
    sent = xmlrpc.client.dumps(("/x", "/k3/value", value), "setParam").replace("\r", "&#13;").encode()
    assert b"200 OK" in guarded.raw(K3, posted(sent))
    assert guarded.master.parameters["/k3/value"] == value


def test_each_call_in_a_multicall_is_judged(guarded: Guarded) -> None:
    calls = [
        ("setParam", "/roslaunch", "/k3/a", 1),
        ("setParam", "/roslaunch", "/epuck/a", 1),
        ("setParam", "/roslaunch", "/rosversion", "1.15"),
        ("system.multicall", [{"methodName": "setParam", "params": ["/x", "/epuck/b", 1]}]),
        ("getParam", "/roslaunch", "/k3/a"),
    ]
    many = [{"methodName": name, "params": given} for name, *given in calls]
    answers = guarded.called(K3, "system.multicall", many)
    assert [one[0][0] for one in answers] == [1, -1, 1, -1, 1]
    assert answers[4][0][2] == 1
    assert not {"/epuck/a", "/epuck/b", "/rosversion"} & guarded.master.parameters.keys()


def test_strangers_are_cut_off(guarded: Guarded) -> None:
    call = xmlrpc.client.dumps(("/x",), "getPid").encode()
    assert guarded.raw(STRANGER, posted(call)) == b""
    assert f"refused: a connection from {STRANGER}" in guarded.journal


@pytest.mark.parametrize(
    "data",
    [
        b"GET / HTTP/1.1\r\n\r\n",
        b"POST / HTTP/1.1\r\n\r\n",
        posted(b"", 1 << 40),
        posted(b"", -1),
        b"x" * (1 << 20),
        posted(b"", 100) + b"x",
    ],
    ids=range(6),
)
def test_what_is_no_request_gets_no_reply(data: bytes, guarded: Guarded) -> None:
    assert guarded.raw(K3, data) == b""


def large(size: int) -> bytes:
    return posted(xmlrpc.client.dumps(("/x", "/k3/robot_description", "x" * size), "setParam").encode())


def test_a_request_of_the_masters_host_may_be_larger(guarded: Guarded) -> None:
    assert b"200 OK" in guarded.raw(K3, large(1000 << 10))
    assert guarded.raw(K3, large(2 << 20)) == b""
    assert b"200 OK" in guarded.raw(LAPTOP, large(2 << 20))
    assert guarded.raw(LAPTOP, large(5 << 20)) == b""


def test_a_crowd_of_one_host_keeps_out_no_other(guarded: Guarded) -> None:
    with ExitStack() as crowd:
        for _ in range(2 * proxy._MOST_OF_ONE):
            crowd.enter_context(guarded.connected(EPUCK))
        wait_for(lambda: f"refused: a connection from {EPUCK} (epuck-pi)" in guarded.journal)
        assert guarded.called(K3, "getPid", "/x")[2] == 4711
    wait_for(lambda: guarded.raw(EPUCK, posted(xmlrpc.client.dumps(("/x",), "getPid").encode())))


def test_half_a_request_is_given_up(guarded: Guarded, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(proxy, "_SECONDS", 0.05)
    for half in (b"POST / HT", posted(b"<", 100)):
        with guarded.connected(K3) as one:
            one.sendall(half)
            assert one.recv(1) == b""


BYTES = st.binary(max_size=99)
PLAIN = st.integers(-9, 9) | st.text(max_size=9) | st.none()
VALUES = st.recursive(PLAIN, lambda inner: st.lists(inner, max_size=4))
STRUCTS = st.lists(st.dictionaries(st.sampled_from(["methodName", "params"]), VALUES), max_size=2)
METHODS = st.sampled_from(["registerPublisher", "setParam", "system.multicall", "unregisterService", ""])


def written(method: str, arguments: list[Any]) -> bytes:
    return xmlrpc.client.dumps(tuple(arguments), method, allow_none=True).encode("utf-8", "replace")


CALLS = st.builds(written, METHODS, st.lists(VALUES | STRUCTS, max_size=4))


@given(source=st.sampled_from([LAPTOP, K3, OTHER]), data=BYTES | (BYTES | CALLS).map(posted))
def test_whatever_comes_later_calls_are_served(source: str, data: bytes, guarded: Guarded) -> None:
    guarded.raw(source, data)
    assert guarded.called(source, "getPid", "/x")[2] == 4711


@pytest.mark.parametrize("body", [b"\xff", b"<methodCall/>", b"<" + b"a>" * 999, b""], ids=range(4))
def test_what_is_no_call_is_answered_with_an_error(body: bytes, guarded: Guarded) -> None:
    assert b"refused: this is no call" in guarded.raw(K3, posted(body))


def test_calls_that_are_no_list_are_refused(guarded: Guarded) -> None:
    assert guarded.called(K3, "system.multicall", 3)[0] == -1
    assert guarded.called(K3, "system.multicall", [{"methodName": "getPid"}])[0] == -1


def test_nothing_was_left_uncaught(guarded: Guarded) -> None:
    gc.collect()
    assert not guarded.errors


def test_a_flood_of_refusals_is_counted_not_written(capsys: pytest.CaptureFixture[str]) -> None:
    now = [0.0]
    journal = Journal(lambda: now[0])
    for number in range(100):
        journal(f"refused: {number}\n")
    now[0] = proxy._LINES_SECONDS
    journal("refused: later")
    lines = capsys.readouterr().err.splitlines()
    assert lines[:1] + lines[-2:] == ["refused: 0?", "refused: 80 more", "refused: later"]
    assert len(lines) == proxy._LINES + 2
