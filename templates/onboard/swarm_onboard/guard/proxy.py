"""Listens where nodes look for the master, and passes on to it what the policy permits, as it was read.

The master has no port of its own: it is an object in this process.

Whoever calls may hang, flood or send garbage: connections are few, short and small, and those of one host
keep out no other host.
"""

from __future__ import annotations

import asyncio
import socket
import sys
import time
import xmlrpc.client
from collections import Counter
from typing import Any, Callable, Sequence

from swarm_onboard.common import xmlrpc as ros
from swarm_onboard.common.xmlrpc import NonsenseError, PeerError, within
from swarm_onboard.guard.config import Caller, Config
from swarm_onboard.guard.policy import Policy, RefusedError

_MOST_OF_HUB = 128  # connections; each takes two of the unit's 1024 files
_MOST_OF_OTHERS = 256
_MOST_OF_ONE = 64
_MOST_AT_ONCE = 16  # requests of one host in memory; the others wait
_LARGEST_HEADER = 16 << 10
_LARGEST_REQUEST = 1 << 20  # a robot_description
_LARGEST_OF_HUB = 4 << 20
_SECONDS = 5.0  # for a request to arrive, and for its reply to leave
_LINES, _LINES_SECONDS = 20, 10.0  # of the journal
_MULTICALL = "system.multicall"


class Proxy:
    """The guard of ``master``, which gives the reply to a request of XML-RPC."""

    def __init__(
        self, config: Config, master: Callable[[bytes], bytes], log: Callable[[str], None] | None = None
    ) -> None:
        self._config, self._master = config, master
        self._policy = Policy(config)
        self._log = log or Journal()
        self._open: Counter[str] = Counter()
        self._turns: dict[str, asyncio.Semaphore] = {}

    def use(self, config: Config) -> None:
        """Judges by other parameters from now on; what is registered stays, and where it listens."""
        self._config = self._policy.config = config

    async def start(self, listeners: Sequence[socket.socket]) -> None:
        """Starts to accept connections."""
        for one in listeners:
            await asyncio.start_server(self._attend, sock=one, limit=_LARGEST_HEADER)

    async def _attend(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        address = str((writer.get_extra_info("peername") or ("",))[0])
        caller = self._config.callers.get(address)
        if caller is None or self._is_crowded(caller.host):
            self._log(f"refused: a connection from {address}{f' ({caller.host})' if caller else ''}")
            writer.close()
            return
        self._open[caller.host] += 1
        try:
            await self._serve(caller, address, reader, writer)
        except (OSError, EOFError, asyncio.TimeoutError, asyncio.LimitOverrunError, PeerError):
            pass  # only this connection is lost
        finally:
            self._open[caller.host] -= 1
            writer.close()

    def _is_crowded(self, host: str) -> bool:
        hub = self._config.hub
        if host == hub:
            return self._open[hub] >= _MOST_OF_HUB
        others = sum(self._open.values()) - self._open[hub]
        return self._open[host] >= _MOST_OF_ONE or others >= _MOST_OF_OTHERS

    async def _serve(
        self, caller: Caller, address: str, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        head = await within(_SECONDS, reader.readuntil(b"\r\n\r\n"))
        size = ros.length_in(head.split(b"\r\n")[1:])
        largest = _LARGEST_OF_HUB if caller.host == self._config.hub else _LARGEST_REQUEST
        if not head.startswith(b"POST ") or size is None or size > largest:
            self._log(f"refused: a request of {size} bytes from {address} ({caller.host})")
            return
        async with self._turns.setdefault(caller.host, asyncio.Semaphore(_MOST_AT_ONCE)):
            body = await within(_SECONDS, reader.readexactly(size))
            reply = await self._reply(caller, address, body)
            start = f"HTTP/1.0 200 OK\r\nContent-Type: text/xml\r\nContent-Length: {len(reply)}\r\n\r\n"
            writer.write(start.encode("ascii") + reply)
            await within(_SECONDS, writer.drain())

    async def _reply(self, caller: Caller, address: str, body: bytes) -> bytes:
        """The reply to a request. Raises PeerError for what cannot be passed on."""
        try:
            arguments, method = await _apart(body, ros.loads, body)
            several = _calls_in(arguments) if method == _MULTICALL else None
        except (NonsenseError, xmlrpc.client.Fault):
            self._log(f"refused: what is no call from {address} ({caller.host})")
            return _dumped(([-1, "refused: this is no call", 0],), None)
        calls = [(str(method), arguments)] if several is None else several
        own = [self._judged(caller, address, *call) for call in calls]
        passed = [call for call, answer in zip(calls, own) if answer is None]
        if several is None:
            return _dumped((own[0],), None) if own[0] is not None else await self._pass(*calls[0])
        many = [{"methodName": name, "params": list(given)} for name, given in passed]
        reply = await self._pass(_MULTICALL, (many,))
        if len(passed) == len(calls):
            return reply
        merged: bytes = await _apart(reply, _merged, reply, own)
        return merged

    def _judged(
        self, caller: Caller, address: str, method: str, arguments: Sequence[Any]
    ) -> list[Any] | None:
        """The guard's own answer to a call; None if the master is to answer."""
        try:
            answer = self._policy.answer(caller, method, arguments)
            if answer is None:
                self._policy.check(caller, method, arguments)
        except RefusedError as error:
            call = " ".join([method, *(one for one in arguments[:2] if isinstance(one, str))])
            self._log(f"refused: {call} from {address} ({caller.host}): {error}")
            return [-1, f"refused by the guard of the master: {error}", 0]
        return answer

    async def _pass(self, method: str, arguments: Sequence[Any]) -> bytes:
        try:
            body = _dumped(tuple(arguments), method)
        except (TypeError, OverflowError, RecursionError):
            raise NonsenseError("the call cannot be written") from None
        return await asyncio.get_running_loop().run_in_executor(None, self._master, body)


class Journal:
    """Writes lines for people, some in 10 s, and how many it left out."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._since, self._written, self._left_out = clock(), 0, 0

    def __call__(self, line: str) -> None:
        """Writes ``line``, without what is no text, unless there are too many."""
        now = self._clock()
        if now - self._since >= _LINES_SECONDS:
            if self._left_out:
                _write(f"refused: {self._left_out} more")
            self._since, self._written, self._left_out = now, 0, 0
        if self._written < _LINES:
            self._written += 1
            _write(line)
        else:
            self._left_out += 1


def _write(line: str) -> None:
    text = "".join(one if one.isprintable() else "?" for one in line[:400])
    print(text, file=sys.stderr, flush=True)


async def _apart(large: bytes, function: Callable[..., Any], *arguments: Any) -> Any:
    """What ``function`` returns; for a large document it runs in another thread."""
    if len(large) <= ros.PIECE:
        return function(*arguments)
    return await asyncio.get_running_loop().run_in_executor(None, function, *arguments)


def _calls_in(arguments: Sequence[Any]) -> list[tuple[str, Sequence[Any]]]:
    """The calls of a system.multicall. Raises NonsenseError."""
    try:
        (many,) = arguments
        calls = [(one["methodName"], one["params"]) for one in many]
    except (TypeError, ValueError, KeyError):
        raise NonsenseError("the calls are not in the format of a system.multicall") from None
    if not all(isinstance(name, str) and isinstance(given, list) for name, given in calls):
        raise NonsenseError("the calls are not in the format of a system.multicall")
    return calls


def _merged(reply: bytes, own: Sequence[Any]) -> bytes:
    """The reply to all calls: those that the guard answers itself, among those of the master."""
    try:
        (answers,), _ = ros.loads(reply)
    except xmlrpc.client.Fault as fault:
        raise NonsenseError(f"the master refused: {fault.faultString[:80]}") from None
    if not isinstance(answers, list) or len(answers) != own.count(None):
        raise NonsenseError("the answer is not that of a ROS master")
    rest = iter(answers)
    return _dumped(([next(rest) if one is None else [one] for one in own],), None)


def _dumped(values: tuple[Any, ...], method: str | None) -> bytes:
    """The XML-RPC document; a carriage return is written so that it stays one."""
    text = xmlrpc.client.dumps(values, method, methodresponse=method is None or None, allow_none=True)
    return text.replace("\r", "&#13;").encode("utf-8")
