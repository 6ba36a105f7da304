"""A change of a fake host from one release to another, and the agent's steps on the way."""

from __future__ import annotations

from tests.onboard.agent.fakehost import FakeHost, bundle

OLD = bundle("1")
NEW = bundle("2", units=("master", "khepera"), hosts="10.0.0.2 pi\n")
CHANGE = {
    "previous": OLD.digest,
    "stop": ["koala.service"],
    "restart": ["master.service"],
    "start": ["khepera.service"],
}

BEFORE_RECORD = ["lock", "preflight", "stage", "sync", "verify", "publish"]
BEFORE_FLIP = [*BEFORE_RECORD, "record", "stop"]
UNDOABLE = ["stop", "flip", "switch", "links", "blocks", "reload", "live", "start"]
AFTER_FLIP = ["flip", "switch", "links", "blocks", "reload", "live", "start", "done", "collect"]
TAKEN = ["publish", "stop", "links", "done"]


def runs(host: FakeHost, release: str, units: tuple[str, ...]) -> None:
    """Nothing of another release is left."""
    seen = host.observe()
    assert seen.release == release
    assert seen.drift == ({}, {}, {})
    assert seen.staging == []
    assert seen.lock is None
    assert seen.transaction.state in ("", "applied", "undone")
    assert sorted(host.units()) == sorted(f"{unit}.service" for unit in units)
