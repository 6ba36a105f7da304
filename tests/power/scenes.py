"""What a host does while its power is cut, and the whole states that it may be in after the next boot."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from swarm_onboard.agent import files

from swarmctl.render.bundle import Bundle
from tests.onboard.agent.fakehost import BOOT, NO_SECRETS, FakeHost, message_for
from tests.power.host_states import (
    BETWEEN,
    FIRST,
    KNOWN,
    MORE_FILES,
    NEW,
    NEXT,
    OLD,
    OWN,
    SECOND,
    TUNED,
    recovery,
)

TXID, EARLIER = "0123456789abcdef", "e" * 16
_ALL = ("master.service", "koala.service", "khepera.service")
_CHANGE = {"stop": ["koala.service"], "restart": ["master.service"], "start": ["khepera.service"]}

# A key is its own public one; the first that is made is OWN.
WG = f"""#!/bin/sh
case $1 in pubkey) exec cat ;; genkey) [ -e $SWARM_PREFIX/made ] && exec echo {NEXT} ;; *) exit ;; esac
touch $SWARM_PREFIX/made; echo {OWN}
"""

Message = tuple[dict[str, Any], bytes]
_KEY = {"verb": "wireguard_key", "swarm": "new"}
_KOALA = {"swarm": "new", "robots": ["koala"], "others": False}
_STOP: Message = ({"verb": "stop", "who": "someone@laptop", "patience": 0.0, **_KOALA}, b"")


@dataclass(frozen=True)
class Scene:
    """``prepare`` brings the host to where it begins; ``unwritten`` is what it did last, which nobody has had
    written to the disk. ``message`` is then sent to the agent; without one the recovery unit runs in boot 1.
    ``may``: the states after a cut; ``ends``: the state after the answer, with ``clean`` nothing is left over
    then."""

    name: str
    prepare: Callable[[FakeHost], None]
    message: Message | None
    may: frozenset[str]
    ends: str
    unwritten: Callable[[FakeHost], None] = lambda _: None
    clean: bool = False

    def process(self, host: FakeHost) -> tuple[list[str], dict[str, str], bytes]:
        """Returns the command that is cut, its environment and its input."""
        if self.message is None:
            found = recovery(host)
            assert found is not None, "the recovery unit would not run"
            return found[0], found[1], b""
        request, payload = self.message
        head = json.dumps({**request, "payload": len(payload)}).encode() + b"\n"
        return [sys.executable, "-I", "-S", "-c", BOOT], host.environment(), head + payload


def change(
    base: Bundle | None, following: Bundle, secrets: Mapping[str, str] = NO_SECRETS, **more: Any
) -> Message:
    """Returns the request that brings a host from ``base`` to ``following``, with new ``secrets``."""
    return message_for(following, secrets, **{"previous": base and base.digest, "txid": TXID, **more})


def follow(current: Bundle | None, following: Bundle, keys: str) -> Message:
    """Returns the request of a deploy that starts all units anew, and brings ``keys``."""
    return change(current, following, FIRST, txid="f" * 16, stop=list(_ALL), wireguard_keys=keys)


def sent(host: FakeHost, message: Message) -> None:
    """Sends a request that must succeed."""
    reply = host.ask(*message)
    assert not reply.error, reply


def _fresh(host: FakeHost) -> None:
    """The host has never seen the swarm."""


def _old(host: FakeHost) -> None:
    sent(host, change(None, OLD, FIRST, txid=EARLIER))


def _new(host: FakeHost) -> None:
    _old(host)
    sent(host, change(OLD, NEW, SECOND, **_CHANGE, txid="d" * 16))


def _not_driving(host: FakeHost) -> None:
    """No driver runs that would have to answer a reload."""
    _old(host)
    (host.prefix / "units/koala.service").unlink()


def _damaged(host: FakeHost) -> None:
    """Of the release two files are damaged, one is lost, and one is not of it."""
    _old(host)
    release = host.prefix / f"opt/swarm/new/releases/{OLD.digest}"
    (release / "params/koala.yaml").write_text("version: 9\n")
    (release / "hosts").unlink()
    (release / "stray").touch()
    (release / "manifest.json").write_text("")


def _stopped(host: FakeHost) -> None:
    _old(host)
    sent(host, _STOP)


def _with_wg(host: FakeHost) -> None:
    wg = host.prefix / "bin/wg"
    wg.write_text(WG)
    wg.chmod(0o755)


def _in_use(host: FakeHost) -> None:
    """A driver was killed a moment ago: its socket is there, and does not answer."""
    _old(host)
    folder = host.prefix / "run/swarm-new.koala"
    folder.mkdir()
    (folder / "motion").touch()


def _killed_after_learning(host: FakeHost) -> None:
    _unnamed(host, "wireguard.keys", KNOWN, 0o644)


def _killed_after_making(host: FakeHost) -> None:
    _unnamed(host, "wireguard.key", OWN, 0o600)
    _killed_after_learning(host)


def _unnamed(host: FakeHost, name: str, text: str, mode: int) -> None:
    """An agent was killed before it had the name of its new file written."""
    place = host.prefix / f"etc/swarm/new/{name}"
    place.parent.mkdir(parents=True, exist_ok=True)
    draft = files.draft(str(place))
    files.write_new(draft, f"{text.strip()}\n".encode(), mode)
    files.sync(draft)
    Path(draft).rename(place)


def _next_key(host: FakeHost) -> None:
    """The host has a key and the next one, and knows that of a peer."""
    _old(host)
    _with_wg(host)
    sent(host, ({**_KEY, "known": KNOWN}, b""))
    sent(host, ({**_KEY, "make_next": True}, b""))


def _failing(host: FakeHost) -> None:
    _old(host)
    (host.prefix / f"broken-khepera.service-{NEW.digest}").touch()


def _failing_first(host: FakeHost) -> None:
    (host.prefix / f"broken-koala.service-{OLD.digest}").touch()


def _pending(host: FakeHost) -> None:
    _old(host)
    sent(host, change(OLD, NEW, SECOND, **_CHANGE, confirm_within=3600))


def _full(host: FakeHost) -> None:
    _old(host)
    before = OLD
    for number, following in enumerate(BETWEEN):
        sent(host, change(before, following, start=[], txid=f"{number:016x}"))
        before = following


def _died(
    message: Message, failpoint: str, begin: Callable[[FakeHost], None] = _old
) -> Callable[[FakeHost], None]:
    """Returns what brings a host to boot 1 after its agent has died at ``failpoint``."""

    def prepare(host: FakeHost) -> None:
        begin(host)
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
_NEW = change(OLD, NEW, SECOND, **_CHANGE)
_ROTATE = change(OLD, OLD, SECOND, start=[], restart=["koala.service"])
_BACK: Message = (
    {
        "verb": "rollback",
        "swarm": "new",
        "txid": TXID,
        "previous": NEW.digest,
        "next": OLD.digest,
        "secrets": EARLIER,
    },
    b"",
)
_MORE = change(OLD, MORE_FILES, start=[], files_only=True)
_TUNE = change(OLD, TUNED, FIRST, start=[], reload_unit=["koala.service"])
_REPAIR = change(OLD, OLD, start=[], restart=["koala.service"])
_EITHER = frozenset({"old", "new"})

SCENES = (
    Scene("first deploy", _fresh, change(None, OLD, FIRST), frozenset({"none", "old"}), "old"),
    Scene("deploy", _old, _NEW, _EITHER, "new"),
    Scene(
        "deploy, unconfirmed",
        _old,
        change(OLD, NEW, SECOND, **_CHANGE, confirm_within=3600),
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
    Scene("undo of a first deploy", _failing_first, change(None, OLD, FIRST), frozenset({"none"}), "none"),
    Scene("undo at boot", _died(_NEW, "after:blocks"), None, frozenset({"old"}), "old"),
    Scene("undo at boot, unconfirmed", _died_pending, None, frozenset({"old"}), "old"),
    Scene(
        "garbage collection",
        _full,
        change(BETWEEN[-1], NEW, SECOND, **_CHANGE),
        frozenset({"between 2", "new"}),
        "new",
    ),
    Scene("files alone", _old, _MORE, frozenset({"old", "old, more files"}), "old, more files"),
    Scene("secrets", _old, _ROTATE, frozenset({"old", "old, new secrets"}), "old, new secrets"),
    Scene("undo of secrets at boot", _died(_ROTATE, "after:switch"), None, frozenset({"old"}), "old"),
    Scene("live parameters", _not_driving, _TUNE, frozenset({"old", "old, tuned"}), "old, tuned"),
    Scene(
        "undo of live parameters at boot",
        _died(_TUNE, "after:live", _not_driving),
        None,
        frozenset({"old"}),
        "old",
    ),
    Scene("rollback", _new, _BACK, _EITHER, "old"),
    Scene(
        "new key, lost peer",
        _next_key,
        ({**_KEY, "expel": "pi", "use": NEXT}, b""),
        frozenset({"old, next key", "old, next key, pi expelled", "old, new key, pi expelled"}),
        "old, new key, pi expelled",
    ),
    Scene(
        "first key",
        _with_wg,
        ({**_KEY, "known": KNOWN}, b""),
        frozenset({"none", "none, key of pi", "none, key"}),
        "none, key",
    ),
    Scene(
        "first key, after a kill",
        _with_wg,
        (_KEY, b""),
        frozenset({"none", "none, own key", "none, key"}),
        "none, key",
        _killed_after_making,
    ),
    Scene(
        "restart, after a kill",
        _old,
        (change(OLD, OLD, start=[], restart=["koala.service"], wireguard_keys=KNOWN)[0], b""),
        frozenset({"old", "old, key of pi"}),
        "old, key of pi",
        _killed_after_learning,
    ),
    Scene("repair", _damaged, _REPAIR, frozenset({"mixed", "old"}), "old"),
    Scene("stop", _old, _STOP, frozenset({"old", "old, koala stopped"}), "old, koala stopped"),
    Scene(
        "stop of a robot in use",
        _in_use,
        ({"verb": "motion", "swarm": "new", "who": "someone@laptop", "robots": ["koala"], "stop": True}, b""),
        frozenset({"old", "old, koala stopped"}),
        "old, koala stopped",
    ),
    Scene(
        "start",
        _stopped,
        ({"verb": "start", **_KOALA}, b""),
        frozenset({"old", "old, koala stopped"}),
        "old",
    ),
    Scene("remove", _old, _REMOVE, frozenset({"old", "none"}), "none", clean=True),
    Scene(
        "remove, at boot",
        _died(_REMOVE, "after:withdraw"),
        None,
        frozenset({"none"}),
        "none",
        clean=True,
    ),
)
