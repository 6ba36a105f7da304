"""From one release to the next: a host is old or new, whatever happens on the way.

Nothing that runs notices it, so it cannot lock anybody out, and it stays without a confirmation. Whatever
ends the agent, or the power, ``current`` says whether it took place, and there is nothing to undo.

A change stays pending until it is confirmed; without a confirmation it is undone. The recovery unit undoes
what an agent that died has begun.
"""

from __future__ import annotations

from . import (
    audit,
    boot,
    disk,
    files,
    live_parameters,
    motion_gate,
    next_release,
    record,
    recovery_unit,
    rollback,
    secrets,
    system_links,
    systemd,
    unit_start,
)
from .errors import FailedError, RefusedError
from .failpoint import passed
from .manifest import EMPTY, Manifest
from .named_tuple import NamedTuple
from .record import Change, Record, State
from .release_store import KEPT_RELEASES, KEPT_SETS, Home
from .rpc import Report
from .steps import Kind

TYPE_CHECKING = False

if TYPE_CHECKING:
    from typing import Iterable, Sequence


def keep_change(home: Home, done: Record) -> None:
    """Closes the record of a change that stays, and removes what nothing needs any more."""
    states = [State(done.next or "", done.next_secrets), *done.before, *done.history]
    kept = done._replace(state=record.APPLIED, history=tuple(_newest(states)))
    files.remove(home.spare)
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
    rollback.collect_secrets(home, kept)
    passed("collect")


def _newest(states: Iterable[State]) -> list[State]:
    """The states to keep: of the newest ``KEPT_RELEASES``, each with its last ``KEPT_SETS`` sets."""
    found: list[State] = []
    for one in dict.fromkeys(states):
        releases = {other.release for other in found}
        sets = sum(other.release == one.release for other in found)
        if sets < KEPT_SETS if sets else len(releases) < KEPT_RELEASES:
            found.append(one)
    return found


def switch(home: Home, change: Change, manifest: Manifest, before: Record, report: Report) -> None:
    """Makes ``change.next`` current. Raises ``RefusedError``, before it, if the change is more than files."""
    if more := _more(home, change, manifest, home.known_manifest(home.current()) or EMPTY):
        raise RefusedError(
            f"stale plan: the change was to be of files alone, and {more}", "run the same command again"
        )
    begun = record.begun(home, change, record.SWITCHING)._replace(history=before.history)
    report.detach()
    record.write(home, begun)
    passed("switching")
    files.point(home.current_link, "releases/" + change.next)
    passed("flip")
    keep_change(home, begun)


def _more(home: Home, change: Change, manifest: Manifest, old: Manifest) -> str:
    """What the change is beside files of the release; empty if that is all."""
    shown = {*old.links.values(), *old.blocks.values()}
    if change.previous in (None, change.next):
        return "the release is not another one"
    if change.steps:
        return "units or daemons change"
    if change.values or change.secrets is not None or manifest.secrets != old.secrets:
        return "secrets change"
    if (manifest.units, manifest.links, manifest.blocks) != (old.units, old.links, old.blocks):
        return "units, links or blocks change"
    if any(manifest.files.get(path) != old.files.get(path) for path in shown):
        return "a file changes that is shown elsewhere on the host"
    astray = [
        *system_links.link_deviations(home, manifest.links),
        *system_links.block_deviations(home, change.next, manifest),
    ]
    return f"{astray[0]} is not as deployed" if astray else ""


class Applied(NamedTuple):
    """The new release, and the one before."""

    release: str
    previous: str | None


def run(home: Home, change: Change, payload: bytes, report: Report) -> Applied:
    """Carries the change out; the lock is held. Raises ``FailedError`` after having gone back."""
    home.check_current()
    secrets.check(home)
    home.clean_staging()
    before = finished(home)
    rollback.collect_secrets(home, before)
    current = home.current()
    if change.previous != current:
        raise RefusedError(
            "stale plan: it was made for release {}, the host has {}".format(
                change.previous or "none", current or "none"
            ),
            "someone deployed in between; run the same command again",
        )
    next_release.keep_edits(home, current, report)
    manifest = next_release.bring(home, change, payload, report)
    _check_units(change, manifest)
    swapped = change.targets(Kind.STOP, Kind.RESTART)
    motion_gate.clear(home, swapped, stop=change.stop_robots, who=change.who, note=report.note)
    system_links.check(home, manifest)
    if change.files_only:
        switch(home, change, manifest, before, report)
        return Applied(change.next, current)
    begun = _prepared(home, change, manifest, before, report)
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
        keep_change(home, begun)
    return Applied(change.next, begun.previous)


def confirm(home: Home, txid: str) -> str:
    """Makes the pending change ``txid`` the one that stays; the lock is held. Returns its release.

    Confirming twice is not an error. Raises ``RefusedError`` for another change, ``FailedError`` for one that
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
        keep_change(home, found)
    elif found.state != record.APPLIED:
        raise FailedError(found.error)
    return found.next or ""


def finished(home: Home) -> Record:
    """Undoes what a dead agent left open; returns the last record. The lock is held.

    Raises ``RefusedError`` while a change waits for its confirmation.
    """
    if (done := record.switched(home)) is not None:
        keep_change(home, done)
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


def _check_units(change: Change, manifest: Manifest) -> None:
    staying = change.targets(Kind.START, Kind.RESTART, Kind.RELOAD_UNIT)
    unknown = [unit for unit in staying if unit not in manifest.units]
    if unknown:
        raise RefusedError("{} is not a unit of release {}".format(", ".join(unknown), change.next))


def _prepared(home: Home, change: Change, manifest: Manifest, before: Record, report: Report) -> Record:
    """Returns the record of a change that can be undone from here on. Nothing of it stays if that fails."""
    try:
        chosen = next_release.store_secrets(home, change, manifest)
        begun = _begun(home, change, manifest, chosen, before.history)
        report.detach()
        recovery_unit.install(home)
        recovery_unit.watch(home)
        disk.hold_spare(home.spare)
    except (RefusedError, OSError):
        files.remove(home.spare)
        rollback.collect_secrets(home, before)
        raise
    return begun


def _begun(home: Home, change: Change, manifest: Manifest, chosen: str, history: tuple[State, ...]) -> Record:
    """The record of a change before its first step."""
    current = home.current()
    astray = system_links.daemons_of(
        [
            *system_links.link_deviations(home, manifest.links),
            *system_links.block_deviations(home, change.next, manifest),
        ]
    )
    touched = _unique(change.targets(Kind.STOP, Kind.RESTART, Kind.START))
    stale = _stale_daemons(home.known_manifest(current), manifest)
    daemons = _unique(change.targets(Kind.RELOAD) + astray + stale)
    return record.begun(home, change, record.APPLYING)._replace(
        next_secrets=chosen,
        touched=tuple(touched),
        active=tuple(systemd.running(touched)),
        reload=tuple(daemons),
        reloaded=tuple(change.targets(Kind.RELOAD_UNIT)),
        history=history,
    )


def _forward(home: Home, change: Change, manifest: Manifest, begun: Record, report: Report) -> None:
    starting = change.targets(Kind.START, Kind.RESTART)
    stopping = _unique(change.targets(Kind.STOP, Kind.RESTART))
    if stopping:
        report.note(f"stopping {named(stopping)}")
        systemd.stop(stopping)
    passed("stop")
    files.point(home.current_link, "releases/" + change.next)
    passed("flip")
    secrets.point(home, begun.next_secrets)
    passed("switch")
    system_links.put_links(home, manifest)
    passed("links")
    system_links.put_blocks(home, change.next, manifest)
    passed("blocks")
    unit_start.reload_daemons(home, begun.reload)
    systemd.forget([unit for unit in change.targets(Kind.STOP) if unit not in manifest.units])
    passed("reload")
    if begun.reloaded:
        report.note(f"reloading {named(begun.reloaded)}")
        live_parameters.take(home, begun.reloaded)
    passed("live")
    units = [unit for unit in manifest.units if unit in starting]
    if units:
        report.note(f"starting {named(units)}")
        unit_start.start(units)
    passed("start")


def _undone(home: Home, begun: Record, cause: Exception, report: Report) -> FailedError:
    """Goes back to the release before. Returns the error to report."""
    if isinstance(cause, OSError) and disk.is_full(cause):
        cause = disk.full(cause.filename or home.path, "the change")
    report.note(f"undoing: {cause}")
    try:
        error = rollback.undo(home, begun, str(cause))
    except (RefusedError, OSError) as trouble:
        return FailedError(
            "{}; going back to release {} failed too: {}".format(cause, begun.previous or "none", trouble),
            "the host is between two releases and tries again to go back: fix the cause",
        )
    error.hint = getattr(cause, "hint", "")
    return error


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
