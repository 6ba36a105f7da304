"""From one release to the next: a host is old or new, whatever happens on the way.

A change stays pending until it is confirmed; without a confirmation it is undone. The recovery unit undoes
what an agent that died has begun.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Sequence

from . import (
    audit,
    boot,
    edits,
    files,
    motion_gate,
    record,
    recovery_unit,
    rollback,
    secrets,
    staging,
    system_links,
    systemd,
    unit_start,
    upload,
)
from .errors import FailedError, RefusedError
from .failpoint import passed
from .manifest import Manifest
from .record import Record
from .release_store import Home, unwritable
from .rpc import Report

if TYPE_CHECKING:
    from .messages import ApplyAnswer, ConfirmAnswer

KEPT_RELEASES = 3  # the current one and two before it


class Change(NamedTuple):
    """The requested change. ``base`` is the release that the plan was made for; ``confirm_within``: s until
    it is undone without a confirmation, 0 if none is needed; ``stop_robots``: robots that move or are under
    command are stopped; without it the change is refused."""

    txid: str
    who: str
    run: str
    base: str | None
    next: str
    stop: list[str]
    start: list[str]
    restart: list[str]
    reload: list[str]
    confirm_within: float
    stop_robots: bool = False


def run(home: Home, change: Change, payload: bytes, report: Report) -> ApplyAnswer:
    """Carries the change out; the lock is held. Raises ``FailedError`` after having gone back."""
    home.check_current()
    home.clean_staging()
    before = finished(home)
    current = home.current()
    if change.base != current:
        raise RefusedError(
            "stale plan: it was made for release {}, the host has {}".format(
                change.base or "none", current or "none"
            ),
            "someone deployed in between; run the same command again",
        )
    _keep_edits(home, current, report)
    manifest = _bring(home, change, payload, report)
    _check_units(change, manifest)
    swapped = [*change.stop, *change.restart]
    motion_gate.clear(home, swapped, stop=change.stop_robots, who=change.who, note=report.note)
    system_links.check(home, manifest)
    begun = _begun(home, change, manifest, before.history)
    report.detach()
    recovery_unit.install(home)
    recovery_unit.watch(home)
    try:
        record.write(home, begun)
        passed("record")
        _forward(home, change, manifest, begun, report)
        if change.confirm_within:
            deadline = boot.now() + change.confirm_within
            record.write(home, begun._replace(state=record.PENDING, deadline=deadline))
            passed("pending")
    except (RefusedError, OSError) as error:
        raise _undone(home, begun, error, report) from error
    if not change.confirm_within:
        _keep(home, begun)
    return {"release": change.next, "previous": begun.prev, "units": systemd.states(manifest.units)}


def confirm(home: Home, txid: str) -> ConfirmAnswer:
    """Makes the pending change ``txid`` the one that stays; the lock is held.

    Confirming twice is no error. Raises ``RefusedError`` for another change, ``FailedError`` for one that
    was undone.
    """
    found = record.read(home)
    if found.txid != txid:
        raise RefusedError(
            f"another deploy followed, by {found.who or 'someone'}", "`swarmctl plan` shows the result"
        )
    if found.state == record.PENDING:
        if not found.left(home):
            raise rollback.undo(home, found, rollback.cause(home, found))
        _keep(home, found)
    elif found.state != record.APPLIED:
        raise FailedError(found.error)
    return {"release": found.next or ""}


def finished(home: Home) -> Record:
    """Undoes what a dead agent left open; returns the last record. The lock is held.

    Raises ``RefusedError`` while a change waits for its confirmation.
    """
    found = record.read(home)
    if found.left(home):
        raise waiting(home, found)
    if not found.open:
        return found
    if found.state == record.REMOVING:
        raise RefusedError("a removal of the swarm is not finished", "run `swarmctl remove` again")
    rollback.undo(home, found, rollback.cause(home, found))
    return record.read(home)


def waiting(home: Home, found: Record) -> RefusedError:
    """Returns the error for others while a change waits for its confirmation."""
    return RefusedError(
        f"locked by {found.who or 'someone'}, whose deploy waits for its confirmation",
        f"run the same command again; it is confirmed or undone within {found.left(home):.0f} s",
    )


def _bring(home: Home, change: Change, payload: bytes, report: Report) -> Manifest:
    """The next release, complete under its own name; nothing outside it has changed."""
    if not payload:
        manifest = home.known_manifest(change.next)
        if manifest is None or home.deviations(change.next, manifest):
            raise RefusedError(f"release {change.next} is not on the host", "run the same command again")
        _prove_writable(home)
        return manifest
    stored = home.kept(change.base)

    def kept(sha256: str) -> bytes | None:
        found = stored(sha256)
        return upload.content(home, sha256) if found is None else found

    manifest, content, found = staging.unpack(payload, change.next, kept)
    staging.check_space(home, manifest)
    _prove_writable(home)
    passed("preflight")
    report.note(f"staging {len(manifest.files)} files")
    folder = staging.stage(home, change.txid, manifest, content, found)
    staging.verify(folder, manifest)
    staging.publish(home, folder, change.next, manifest)
    upload.clear(home)
    return manifest


def _keep_edits(home: Home, current: str | None, report: Report) -> None:
    """Copies what people have edited: this change replaces it. Raises ``RefusedError``."""
    manifest = home.known_manifest(current)
    if current is None or manifest is None:
        return
    try:
        copies = edits.keep(home, current, manifest)
    except OSError as error:
        raise unwritable(home, error) from error
    for copy in copies:
        report.note(f"kept an edit as {copy}")


def _prove_writable(home: Home) -> None:
    probe = home.state + "/probe"
    try:
        files.remove(probe)
        files.write_new(probe, b"swarm", 0o644)
        files.remove(probe)
    except OSError as error:
        raise unwritable(home, error) from error


def _check_units(change: Change, manifest: Manifest) -> None:
    unknown = [unit for unit in change.start + change.restart if unit not in manifest.units]
    if unknown:
        raise RefusedError("{} is not a unit of release {}".format(", ".join(unknown), change.next))


def _begun(home: Home, change: Change, manifest: Manifest, history: Sequence[str]) -> Record:
    """The record of a change before its first step."""
    current = home.current()
    astray = system_links.daemons_of(
        [
            *system_links.link_deviations(home, manifest.links),
            *system_links.block_deviations(home, change.next, manifest),
        ]
    )
    touched = _unique(change.stop + change.restart + change.start)
    daemons = _unique(change.reload + astray + _stale_daemons(home.known_manifest(current), manifest))
    return Record(
        state=record.APPLYING,
        txid=change.txid,
        who=change.who,
        run=change.run,
        boot_id=boot.identity(home),
        prev=current,
        next=change.next,
        touched=tuple(touched),
        active=tuple(systemd.running(touched)),
        reload=tuple(daemons),
        history=tuple(history),
    )


def _forward(home: Home, change: Change, manifest: Manifest, begun: Record, report: Report) -> None:
    starting = change.start + change.restart
    stopping = _unique(change.stop + change.restart)
    if stopping:
        report.note(f"stopping {named(stopping)}")
        systemd.stop(stopping)
    passed("stop")
    files.point(home.current_link, "releases/" + change.next)
    passed("flip")
    system_links.put_links(home, manifest)
    passed("links")
    system_links.put_blocks(home, change.next, manifest)
    passed("blocks")
    systemd.reload(home, begun.reload)
    passed("reload")
    units = [unit for unit in manifest.units if unit in starting]
    if units:
        report.note(f"starting {named(units)}")
        unit_start.start(units)
    passed("start")


def _undone(home: Home, begun: Record, cause: Exception, report: Report) -> FailedError:
    """Goes back to the release before. Returns the error to report."""
    report.note(f"undoing: {cause}")
    try:
        error = rollback.undo(home, begun, str(cause))
    except (RefusedError, OSError) as trouble:
        return FailedError(
            "{}; going back to release {} failed too: {}".format(cause, begun.prev or "none", trouble),
            "the host is between two releases and tries again to go back: fix the cause",
        )
    error.hint = getattr(cause, "hint", "")
    return error


def _keep(home: Home, done: Record) -> None:
    """Closes the record of a change that stays, and removes what nothing needs any more."""
    history = _unique([one for one in (done.next, done.prev, *done.history) if one])[:KEPT_RELEASES]
    kept = done._replace(state=record.APPLIED, history=tuple(history))
    audit.note(home, kept)
    try:
        record.write(home, kept)
    except OSError as error:
        raise FailedError(
            f"release {done.next} runs, but that cannot be recorded: {error.strerror}",
            "repair the disk, then deploy again",
        ) from error
    passed("done")
    rollback.collect(home, kept)
    secrets.forget_unneeded(home, kept.history)  # a rollback needs those of the releases before
    passed("collect")


def _stale_daemons(before: Manifest | None, after: Manifest) -> list[str]:
    """Returns the daemons that read a file through ``current`` whose content changes."""
    if before is None:
        return ["systemd", "udev"]
    changed = [
        path
        for path in set(before.links) & set(after.links)
        if before.files[before.links[path]] != after.files[after.links[path]]
    ]
    return system_links.daemons_of(changed)


def _unique(names: Sequence[str]) -> list[str]:
    return list(dict.fromkeys(names))


def named(units: Sequence[str]) -> str:
    """One or two names; more are counted."""
    return " and ".join(units) if len(units) <= 2 else f"{len(units)} units"
