"""Back to the release before: at once, after the deadline of a confirmation, or at the next boot.

May be interrupted and begun again. What it goes back to is in the record, never derived from dates or order.
"""

from __future__ import annotations

from . import (
    audit,
    boot,
    files,
    live_parameters,
    record,
    recovery_unit,
    secrets,
    system_links,
    systemd,
    unit_start,
)
from .errors import FailedError
from .failpoint import passed
from .manifest import release_name
from .record import Record
from .release_store import Home
from .steps import Kind, Step

TYPE_CHECKING = False

if TYPE_CHECKING:
    from typing import Callable


def steps_back(home: Home, release: str, chosen: str) -> list[Step]:
    """Returns the steps from the current release to another one with the set ``chosen`` of secrets."""
    current = home.current()
    same = release == current
    cause = "with the secrets that it had before" if same else f"replaces {current}"
    why = "secrets that it reads change" if same else "its files or secrets differ"
    before = {unit["name"]: unit for unit in home.units(current)}
    after = {unit["name"]: unit for unit in home.units(release_name(release))}
    others = secrets.differing(home, secrets.current(home), chosen and release_name(chosen))
    changed = [
        unit
        for unit, one in after.items()
        if unit in before
        and (one["digest"] != before[unit]["digest"] or others & set(one.get("secrets", ())))
    ]
    reload = [
        unit
        for unit in changed
        if before[unit].get("fixed", "") == after[unit].get("fixed")
        and not others & set(after[unit].get("secrets", ()))
    ]
    return [
        *(Step(Kind.STOP, unit, f"not part of {release}") for unit in before if unit not in after),
        Step(Kind.ACTIVATE, release, cause),
        *(Step(Kind.RELOAD_UNIT, unit, "takes its file while it runs") for unit in reload),
        *(Step(Kind.RESTART, unit, why) for unit in changed if unit not in reload),
        *(Step(Kind.START, unit, f"part of {release}") for unit in after if unit not in before),
    ]


def undo(home: Home, done: Record, because: str) -> FailedError:
    """Goes back from ``done.next`` to ``done.previous``, and starts again what ran before. The lock is held.

    Returns the error to report. Raises ``OSError`` and ``RefusedError`` if files cannot be restored: the
    record stays open then, and the recovery unit goes on.
    """
    files.remove(home.spare)
    record.write(home, done._replace(state=record.UNDOING, error=because))
    manifest = home.manifest(done.previous)
    booting = done.boot_id != boot.identity(home)
    troubles: list[str] = []
    _tried(troubles, lambda: systemd.stop(done.touched))
    passed("undo-stop")
    if done.previous is None:
        files.remove(home.current_link)
        files.sync(home.path)
    else:
        files.point(home.current_link, "releases/" + done.previous)
    secrets.point(home, done.previous_secrets)
    passed("undo-flip")
    changed = system_links.put_links(home, manifest) + system_links.put_blocks(home, done.previous, manifest)
    collect_secrets(home, done)
    passed("undo-outside")
    daemons = [*done.reload, *system_links.daemons_of(changed)]
    _tried(troubles, lambda: unit_start.reload_daemons(home, daemons))
    _tried(troubles, lambda: systemd.forget([unit for unit in done.touched if unit not in manifest.units]))
    if booting:
        _tried(troubles, lambda: systemd.queue_start(system_links.enabled(manifest)))
    else:
        again = [unit for unit in manifest.units if unit in done.active and unit in done.touched]
        _tried(troubles, lambda: live_parameters.take(home, done.reloaded))
        _tried(troubles, lambda: unit_start.start(again))
    error = f"{because}; {_outcome(done, booting, troubles)}"
    undone = done._replace(state=record.UNDONE, error=error)
    audit.note(home, undone)
    record.write(home, undone)
    passed("undone")
    if done.previous is None:
        recovery_unit.remove(home)
    collect(home, done)
    return FailedError(error)


def cause(home: Home, left: Record) -> str:
    """Returns why an open change that its agent left is undone."""
    if left.state != record.PENDING:
        return left.error or "the deploy was interrupted"
    if left.boot_id != boot.identity(home):
        return "the host restarted before the deploy was confirmed"
    return "the deploy was not confirmed in time"


def _outcome(done: Record, booting: bool, troubles: list[str]) -> str:
    if done.previous is None:
        what = "undone, the host is as before"
    else:
        what = f"undone, release {done.previous} " + (
            "is in place again" if booting or troubles else "runs again"
        )
    return "; but ".join([what, *troubles])


def _tried(troubles: list[str], step: Callable[[], None]) -> None:
    """Runs a step that may fail without keeping the files from being restored."""
    try:
        step()
    except FailedError as error:
        troubles.append(error.message)


def collect(home: Home, done: Record) -> None:
    """Removes releases that are neither the current one nor one to go back to. Staging is nobody's by now."""
    kept = {home.current(), done.previous, *(one.release for one in done.history)}
    for digest in home.releases():
        if digest not in kept:
            files.remove_tree(home.release(digest))


def collect_secrets(home: Home, done: Record) -> None:
    """Removes the sets of secrets that are neither the current one nor of a state to go back to."""
    kept = (one.secrets for one in (*done.before, *done.history))
    secrets.forget(home, but=[secrets.current(home), *kept])
