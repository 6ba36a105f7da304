"""Many calls to a ROS 1 master in one request (wiki.ros.org/ROS/Master_API, system.multicall)."""

from __future__ import annotations

import asyncio
import xmlrpc.client
from typing import Any, Sequence, Tuple

from swarm_onboard.common.xmlrpc import PIECE, Names, NonsenseError, bounded, loads, post

#: Method, name of the caller, further arguments.
Call = Tuple[Any, ...]
#: Code and value that a master returned; 1 is success.
Answer = Tuple[int, Any]

LARGEST_REPLY = 2 << 20  # the state of a master that knows some ten thousand registrations
_FAILED = 0


async def exchange(uri: str, calls: Sequence[Call], seconds: float, names: Names) -> bytes:
    """The reply to all ``calls``, within ``seconds``; parse equal replies once. Raises PeerError."""
    many = [{"methodName": method, "params": list(arguments)} for method, *arguments in calls]
    body = xmlrpc.client.dumps((many,), "system.multicall").encode("utf-8")
    return await bounded(seconds, post(uri, body, names, LARGEST_REPLY))


async def answers(reply: bytes, count: int) -> list[Answer]:
    """The master's answer to each of ``count`` calls. A large reply is parsed in another thread."""
    if len(reply) <= PIECE:
        return _answers(reply, count)
    return await asyncio.get_running_loop().run_in_executor(None, _answers, reply, count)


def _answers(reply: bytes, count: int) -> list[Answer]:
    try:
        (several,), _ = loads(reply)
    except xmlrpc.client.Fault as fault:
        raise NonsenseError(f"the master refused: {str(fault.faultString)[:80]}") from None
    if not isinstance(several, list) or len(several) != count:
        raise NonsenseError("the answer is not that of a ROS master")
    return [_answer(one) for one in several]


def _answer(one: Any) -> Answer:
    """Parses ``[[code, message, value]]``; a fault or anything else counts as a failure."""
    try:
        ((code, message, value),) = one
    except (TypeError, ValueError):
        return _FAILED, "no answer"
    return (1, value) if code == 1 else (_FAILED if not isinstance(code, int) else code, message)
