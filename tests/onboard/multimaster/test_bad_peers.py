"""A peer that hangs, floods or sends invalid answers loses only its own topics."""

from __future__ import annotations

import asyncio
import socket
import threading
import time
import xmlrpc.client
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from typing import Any

import pytest
from swarm_onboard.common.slave import SlaveApi, methods
from swarm_onboard.common.xmlrpc import Names, PeerError, within
from swarm_onboard.multimaster import config, rpc
from swarm_onboard.multimaster.bridge import Bridge

from tests.onboard.multimaster.masters import Rosmaster, reply, served
from tests.timing import PATIENCE

KIND = "std_msgs/String"
OWN = "http://127.0.0.1:11311"
Behaviour = Callable[[socket.socket], None]
OK = b"HTTP/1.0 200 OK\r\nContent-Length: %d\r\n\r\n"


def sized(body: bytes) -> bytes:
    return OK % len(body) + body


def answers(data: bytes) -> Behaviour:
    """Read the request, then send ``data``."""

    def behave(connection: socket.socket) -> None:
        connection.recv(1 << 16)
        connection.sendall(data)

    return behave


def hang(connection: socket.socket) -> None:
    """Answer nothing for as long as the other side waits."""
    while connection.recv(1 << 16):
        pass


def drip(connection: socket.socket) -> None:
    connection.recv(1 << 16)
    while True:
        connection.sendall(b"x")
        time.sleep(0.05)


def flood(connection: socket.socket) -> None:
    connection.recv(1 << 16)
    connection.sendall(OK % (1 << 40))
    while True:
        connection.sendall(b"x" * 65536)


def value(of: Any) -> bytes:
    return sized(xmlrpc.client.dumps((of,), methodresponse=True, allow_none=True).encode())


def state(publishers: Any) -> bytes:
    """The answers of a master with ``publishers``."""
    return value([[[1, "", [publishers, [], []]]], [[1, "", []]], [[-1, "", 0]], [[-1, "", ""]]])


BOMB = b'<?xml version="1.0"?><!DOCTYPE a [<!ENTITY b "bbbbbbbb">]><methodResponse>&b;</methodResponse>'
BAD: dict[str, Behaviour] = {
    "hangs": hang,
    "drips": drip,
    "floods": flood,
    "closes at once": lambda connection: None,
    "another protocol": answers(b"SSH-2.0-OpenSSH_9.2\r\n\r\n"),
    "is no ROS node": answers(b"HTTP/1.0 404 Not Found\r\n\r\n"),
    "endless header": answers(b"HTTP/1.0 200 OK\r\n" + b"x: y\r\n" * 50_000),
    "negative size": answers(b"HTTP/1.0 200 OK\r\nContent-Length: -1\r\n\r\n"),
    "cut short": answers(OK % 1000 + b"<methodResponse>"),
    "no XML": answers(sized(b"\x00\xff\xfe garbage")),
    "entities": answers(sized(BOMB)),
    "entities in UTF-16": answers(sized(BOMB.decode().encode("utf-16"))),
    "a fault": answers(sized(xmlrpc.client.dumps(xmlrpc.client.Fault(1, "no")).encode())),
    "a number": answers(value(7)),
    "too few answers": answers(value([])),
    "answers of another form": answers(value([[[1, "", 7]]] * 4)),
    "lists in lists": answers(sized(b"<methodResponse><params><param>" + b"<value><array><data>" * 20_000)),
    "a state of numbers": answers(state([[1, [2]]])),
    "names that are none": answers(state([["/b/odom", ["no name", "", "/ü", "//"]]])),
}  # fmt: skip


@contextmanager
def misbehaving(behave: Behaviour, host: str) -> Iterator[str]:
    """A TCP server that runs ``behave`` on every connection; yields its URI."""
    listener = socket.create_server((host, 0))

    def attend(connection: socket.socket) -> None:
        with connection, suppress(OSError):
            behave(connection)

    def accept() -> None:
        with suppress(OSError):
            while True:
                threading.Thread(target=attend, args=(listener.accept()[0],), daemon=True).start()

    threading.Thread(target=accept, daemon=True).start()
    try:
        yield f"http://{host}:{listener.getsockname()[1]}"
    finally:
        listener.shutdown(socket.SHUT_RDWR)
        listener.close()


def configuration(own: str, good: str, bad: str) -> config.Config:
    peers = [
        {
            "island": name,
            "master": uri,
            "hosts": [host],
            "receives": [{"topic": f"/{name}/odom", "type": KIND}],
        }
        for name, uri, host in (("b", bad, "127.0.0.3"), ("c", good, "127.0.0.2"))
    ]
    times = {"poll_hz": 5.0, "silent_after": 3.0, "remove_after": 30.0}
    me = {"island": "a", "node": "/multimaster_a", "master": own, "address": "127.0.0.1"}
    return config.parse({**me, **times, "peers": peers})


@pytest.mark.parametrize("behaviour", BAD.values(), ids=BAD.keys())
def test_a_bad_peer_loses_only_its_own_topics(behaviour: Behaviour) -> None:
    own, good = Rosmaster(), Rosmaster()
    good.registerPublisher("/c/driver", "/c/odom", KIND, "http://127.0.0.2:4711/")
    with ExitStack() as stack:
        uris = stack.enter_context(served(own)), stack.enter_context(served(good, "127.0.0.2"))
        bad = stack.enter_context(misbehaving(behaviour, "127.0.0.3"))
        asyncio.run(_watched(configuration(*uris, bad), own, good))


async def _watched(settings: config.Config, own: Rosmaster, good: Rosmaster) -> None:
    bridge = Bridge(settings, "http://127.0.0.1:1/")
    work = asyncio.ensure_future(bridge.run())
    await _until(lambda: ("/c/odom", "/c/driver", "http://127.0.0.2:4711/") in own.publishers())
    await _until(lambda: dict(bridge.status().values)["b"] != "no answer yet")
    good.registerPublisher("/c/other", "/c/odom", KIND, "http://127.0.0.2:4712/")
    await _until(lambda: ("/c/odom", "/c/other", "http://127.0.0.2:4712/") in own.publishers())
    assert not any(topic == "/b/odom" for topic, _, _ in own.publishers())
    assert not work.done()
    work.cancel()
    await bridge.unregister_all()
    assert own.publishers() == set()
    assert good.subscribers() == set()


async def _until(condition: Callable[[], bool]) -> None:
    async def holds() -> None:
        while not condition():
            await asyncio.sleep(0.01)

    await asyncio.wait_for(holds(), PATIENCE)


def test_an_unresolved_name_is_reported_and_resolved_later(monkeypatch: pytest.MonkeyPatch) -> None:
    found: dict[str, str] = {}

    def look(host: str, *_: Any, **__: Any) -> list[Any]:
        if host not in found:
            raise socket.gaierror
        return [(0, 0, 0, "", (found[host], 0))]

    with served(Rosmaster(), "127.0.0.2") as one:
        port = one.rsplit(":", 1)[1]
        with served(Rosmaster(), "127.0.0.3", int(port)):
            monkeypatch.setattr(socket, "getaddrinfo", look)

            async def ask() -> bytes:
                return await rpc.exchange(f"http://k3-pi:{port}", [("getPid", "/me")], PATIENCE, Names())

            with pytest.raises(PeerError, match="the name `k3-pi` has no address"):
                asyncio.run(ask())
            for address in ("127.0.0.2", "127.0.0.3"):
                found["k3-pi"] = address
                assert b"4711" in asyncio.run(ask())


@pytest.mark.parametrize("ticks", range(5))
def test_a_cancelled_wait_ends_even_when_its_event_comes(ticks: int) -> None:
    """Otherwise the bridge would register again what `unregister_all` has just removed."""

    async def scenario() -> None:
        event = asyncio.Event()

        async def wait() -> None:
            while True:
                await within(2 * PATIENCE, event.wait())

        task = asyncio.ensure_future(wait())
        await asyncio.sleep(0.01)
        event.set()
        for _ in range(ticks):
            await asyncio.sleep(0)
        event.clear()
        task.cancel()
        await asyncio.wait([task], timeout=PATIENCE)
        assert task.cancelled()

    asyncio.run(scenario())


@pytest.mark.parametrize("slow", ["registerPublisher", "registerSubscriber"])
def test_a_registration_still_under_way_at_the_end_is_removed(
    monkeypatch: pytest.MonkeyPatch, slow: str
) -> None:
    """A master completes a call even if its connection closes, and serves others meanwhile."""
    own, peer = Rosmaster(), Rosmaster()
    peer.registerPublisher("/b/driver", "/b/odom", KIND, "http://127.0.0.3:4711/")

    async def scenario() -> None:
        begun, ended = asyncio.Event(), asyncio.Event()

        async def done(uri: str, calls: Sequence[rpc.Call]) -> bytes:
            begins = any(call[0] == slow and call[2] == "/b/odom" for call in calls)
            if begins:
                begun.set()
                await asyncio.sleep(0.2)
            answer = reply(own if uri == OWN else peer, calls)
            if begins:
                ended.set()
            return answer

        async def exchange(uri: str, calls: Sequence[rpc.Call], *_: object) -> bytes:
            return await asyncio.shield(asyncio.ensure_future(done(uri, calls)))

        monkeypatch.setattr(rpc, "exchange", exchange)
        bridge = Bridge(configuration(OWN, "http://127.0.0.2:1", "http://127.0.0.3:1"), "http://127.0.0.1:1/")
        work = asyncio.ensure_future(bridge.run())
        await asyncio.wait_for(begun.wait(), PATIENCE)
        work.cancel()
        await asyncio.wait([work])
        await bridge.unregister_all()
        await ended.wait()

    asyncio.run(scenario())
    assert own.publishers() == set()
    assert own.parameters == {}
    assert peer.subscribers() == set()


def test_a_name_has_one_pending_lookup_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """Queued lookups at a dead name server would use up the node's threads."""
    looked_up: list[str] = []
    found = threading.Event()

    def look(host: str, *_: Any, **__: Any) -> list[Any]:
        looked_up.append(host)
        found.wait(PATIENCE)
        return [(0, 0, 0, "", ("127.0.0.2", 0))]

    monkeypatch.setattr(socket, "getaddrinfo", look)

    async def scenario(uri: str) -> bytes:
        names, calls = Names(), [("getPid", "/me")]
        for _ in range(5):
            with pytest.raises(PeerError, match="no answer within"):
                await rpc.exchange(uri, calls, 0.02, names)
        assert looked_up == ["k3-pi"]
        found.set()
        return await rpc.exchange(uri, calls, PATIENCE, names)

    with served(Rosmaster(), "127.0.0.2") as one:
        assert b"4711" in asyncio.run(scenario(one.replace("127.0.0.2", "k3-pi")))


DEEP = (
    b"<methodCall><methodName>publisherUpdate</methodName><params><param><value>/m</value></param><param>"
    + b"<value><array><data>" * 4000 + b"</data></array></value>" * 4000
    + b"</param><param><value>/t</value></param></params></methodCall>"
)  # fmt: skip


@pytest.mark.parametrize("sent", [xmlrpc.client.dumps(xmlrpc.client.Fault(1, "x")).encode(), DEEP])
def test_no_request_raises_in_the_slave_api(sent: bytes) -> None:
    raised: list[Any] = []

    async def scenario() -> None:
        asyncio.get_running_loop().set_exception_handler(lambda _, context: raised.append(context))
        api = SlaveApi()
        api.methods = methods("http://here:11311", {}, lambda _: [], lambda _: None)
        reader, writer = await asyncio.open_connection("127.0.0.1", await api.start())
        writer.write(b"POST / HTTP/1.0\r\nContent-Length: %d\r\n\r\n" % len(sent) + sent)
        await reader.read()
        writer.close()

    asyncio.run(scenario())
    assert raised == []


@pytest.mark.parametrize(
    "sent",
    [b"", b"GET / HTTP/1.0\r\n\r\n", b"POST / HTTP/1.0\r\nContent-Length: 99999999\r\n\r\n", b"\0" * 100_000,
     b"POST / HTTP/1.0\r\nContent-Length: 3\r\n\r\n<a>", b"POST /RPC2 HTTP/1.0\r\nContent-Length: 5\r\n\r\n"],
)  # fmt: skip
def test_the_slave_api_survives_invalid_requests(sent: bytes) -> None:
    woken: list[str] = []

    async def scenario() -> None:
        api = SlaveApi()
        api.methods = methods("http://here:11311", {"/diagnostics": "x/Y"}, lambda _: [], woken.append)
        port = await api.start()
        hanging = [await asyncio.open_connection("127.0.0.1", port) for _ in range(6)]
        for _, writer in hanging:
            writer.write(sent)
        loop = asyncio.get_running_loop()
        for call in (
            ("publisherUpdate", "/master", "/odom", ["http://x:1/"]),
            ("getPid", "/x"),
            ("getPid",),
        ):
            answer = await loop.run_in_executor(None, _called, port, *call)
            assert answer[0] == (-1 if call == ("getPid",) else 1)
        for _, writer in hanging:
            writer.close()

    asyncio.run(scenario())
    assert woken == ["/odom"]


def test_connections_of_one_host_to_the_slave_api_are_limited() -> None:
    async def scenario() -> None:
        api = SlaveApi()
        port = await api.start()
        for _ in range(40):  # all hang
            await asyncio.open_connection("127.0.0.1", port, local_addr=("127.0.0.9", 0))
        answer = await asyncio.get_running_loop().run_in_executor(None, _called, port, "getPid", "/x")
        assert answer[0] == -1  # it has no methods, but it answers

    asyncio.run(scenario())


def _called(port: int, method: str, *arguments: Any) -> Any:
    return getattr(xmlrpc.client.ServerProxy(f"http://127.0.0.1:{port}"), method)(*arguments)
