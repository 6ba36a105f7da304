"""What a host does while its power is cut, and the whole states that it may be in after the next boot."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from swarmctl.render.bundle import Bundle
from tests.packages.agent.fakehost import BOOT, FakeHost, payload_of, request_for
from tests.power.host_states import BETWEEN, NEW, OLD, SECRETS, recovery

TXID = "0123456789abcdef"
FIRST = dict.fromkeys(SECRETS, "first")
SECOND = dict.fromkeys(SECRETS, "second")
_ALL = ("master.service", "koala.service", "khepera.service")
_CHANGE = {"stop": ["koala.service"], "restart": ["master.service"], "start": ["khepera.service"]}

Message = tuple[dict[str, Any], bytes]


@dataclass(frozen=True)
class Scene:
    """``prepare`` brings the host to where it begins. ``message`` is then sent to the agent; without one the
    recovery unit runs in boot 1. ``may``: the states after a cut; ``ends``: the state after the answer."""

    name: str
    prepare: Callable[[FakeHost], None]
    message: Message | None
    may: frozenset[str]
    ends: str
    changes_secrets: bool = False

    def secrets(self, ended: bool) -> Mapping[str, set[str]]:
        """Returns the values that each secret may have."""
        values = ({"second"} if ended else {"first", "second"}) if self.changes_secrets else {"first"}
        return dict.fromkeys(SECRETS, values)

    def process(self, host: FakeHost) -> tuple[list[str], dict[str, str], bytes]:
        """Returns the command that is cut, its environment and its input."""
        if self.message is None:
            found = recovery(host)
            assert found is not None, "the recovery unit would not run"
            return found[0], found[1], b""
        request, payload = self.message
        head = json.dumps({**request, "payload": len(payload)}).encode() + b"\n"
        return [sys.executable, "-I", "-S", "-c", BOOT], host.environment(), head + payload


def change(base: Bundle | None, following: Bundle, **more: Any) -> Message:
    """Returns the request that brings a host from ``base`` to ``following``."""
    request = request_for(following, base=base and base.digest, txid=TXID, **more)
    return request, payload_of(following)


def follow(current: Bundle | None, following: Bundle) -> Message:
    """Returns the request of a deploy that starts all units anew."""
    return change(current, following, stop=list(_ALL))


def sent(host: FakeHost, message: Message) -> None:
    """Sends a request that must succeed."""
    reply = host.ask(*message)
    assert not reply.error, reply


def keep_secrets(values: Mapping[str, str]) -> Message:
    """Returns the request that stores secrets."""
    return {"verb": "keep_secrets", "swarm": "new"}, json.dumps(values).encode()


def _fresh(host: FakeHost) -> None:
    sent(host, keep_secrets(FIRST))


def _old(host: FakeHost) -> None:
    _fresh(host)
    sent(host, change(None, OLD))


def _failing(host: FakeHost) -> None:
    _old(host)
    (host.prefix / f"broken-khepera.service-{NEW.digest}").touch()


def _failing_first(host: FakeHost) -> None:
    _fresh(host)
    (host.prefix / f"broken-koala.service-{OLD.digest}").touch()


def _pending(host: FakeHost) -> None:
    _old(host)
    sent(host, change(OLD, NEW, **_CHANGE, confirm_within=3600))


def _full(host: FakeHost) -> None:
    _old(host)
    before = OLD
    for following in BETWEEN:
        sent(host, change(before, following, start=[]))
        before = following


def _died(message: Message, failpoint: str) -> Callable[[FakeHost], None]:
    """Returns what brings a host to boot 1 after its agent has died at ``failpoint``."""

    def prepare(host: FakeHost) -> None:
        _old(host)
        assert host.ask(*message, failpoint=failpoint).status == 137
        _next_boot(host)

    return prepare


def _died_pending(host: FakeHost) -> None:
    _pending(host)
    _next_boot(host)


def _next_boot(host: FakeHost) -> None:
    for unit in (host.prefix / "units").iterdir():
        unit.unlink()
    host.boot(1)


_REMOVE: Message = ({"verb": "remove", "swarm": "new", "who": "someone@laptop"}, b"")
_NEW = change(OLD, NEW, **_CHANGE)
_EITHER = frozenset({"old", "new"})

SCENES = (
    Scene("first deploy", _fresh, change(None, OLD), frozenset({"none", "old"}), "old"),
    Scene("deploy", _old, _NEW, _EITHER, "new"),
    Scene(
        "deploy, unconfirmed",
        _old,
        change(OLD, NEW, **_CHANGE, confirm_within=3600),
        frozenset({"old"}),
        "old",
    ),
    Scene(
        "confirm",
        _pending,
        ({"verb": "confirm", "swarm": "new", "txid": TXID}, b""),
        _EITHER,
        "new",
    ),
    Scene("undo", _failing, _NEW, frozenset({"old"}), "old"),
    Scene("undo of a first deploy", _failing_first, change(None, OLD), frozenset({"none"}), "none"),
    Scene("undo at boot", _died(_NEW, "after:blocks"), None, frozenset({"old"}), "old"),
    Scene("undo at boot, unconfirmed", _died_pending, None, frozenset({"old"}), "old"),
    Scene(
        "garbage collection",
        _full,
        change(BETWEEN[-1], NEW, **_CHANGE),
        frozenset({"between 2", "new"}),
        "new",
    ),
    Scene(
        "keep_secrets",
        _old,
        keep_secrets(SECOND),
        frozenset({"old"}),
        "old",
        changes_secrets=True,
    ),
    Scene("remove", _old, _REMOVE, frozenset({"old", "none"}), "none"),
    Scene("remove, at boot", _died(_REMOVE, "after:withdraw"), None, frozenset({"none"}), "none"),
)
