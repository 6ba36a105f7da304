"""From one release to the next, or back: a host is old or new, whatever happens on the way.

An interrupted transaction leaves an open record. The next one takes over its unfinished business: the units
it stopped, the daemons it had to reload, and the release to go back to.
"""

from __future__ import annotations

import os
import shutil
from typing import TYPE_CHECKING, Any, NamedTuple, Sequence

from . import files, secrets, staging, system_links, systemd, unit_start
from .errors import FailedError, RefusedError
from .failpoint import passed
from .manifest import Manifest
from .paths import AGENT_FOLDER, READERS
from .release_store import Home, unwritable
from .rpc import Report

if TYPE_CHECKING:
    from .messages import ApplyAnswer

OPEN = "applying"
APPLIED = "applied"
UNDONE = "undone"
KEPT_RELEASES = 3  # the current one and two before it


class Change(NamedTuple):
    """The requested change. ``base`` is the release that the plan was made for."""

    txid: str
    who: str
    base: str | None
    next: str
    stop: list[str]
    start: list[str]
    restart: list[str]
    reload: list[str]


class _Business(NamedTuple):
    """What a transaction does to units and daemons, and what it took over from an earlier one."""

    prev: str | None
    touched: list[str]
    inherited: list[str]
    active: list[str]
    reload: list[str]


def run(home: Home, change: Change, payload: bytes, report: Report) -> ApplyAnswer:
    """Carry the change out; the lock is held. Raises ``FailedError`` after having gone back."""
    home.clean_staging()
    record = home.record()
    pending = record if record.get("state") == OPEN else {}
    current = home.current()
    if change.base not in {current, pending.get("prev", current), pending.get("next", current)}:
        raise RefusedError(
            "stale plan: it was made for release {}, the host has {}".format(
                change.base or "none", current or "none"
            ),
            "someone deployed in between; run the same command again",
        )
    manifest = _bring(home, change, payload, report)
    _check_units(change, manifest)
    system_links.check(home, manifest)
    prev = pending["prev"] if pending else current
    before = home.known_manifest(prev)
    inherited = pending.get("touched", [])
    astray = _daemons_of(
        [
            *system_links.link_deviations(home, manifest.links),
            *system_links.block_deviations(home, change.next, manifest),
        ]
    )
    touched = _unique(inherited + change.stop + change.restart + change.start)
    business = _Business(
        prev,
        touched,
        inherited,
        _unique(pending.get("active", []) + systemd.running(touched)),
        _unique(pending.get("reload", []) + change.reload + astray + _stale_daemons(before, manifest)),
    )
    history = [digest for digest in record.get("history", []) if isinstance(digest, str)]
    entry = _entry(change, business, history)
    report.detach()
    files.write_json(home.record_file, dict(entry, state=OPEN))
    passed("record")
    try:
        _forward(home, change, manifest, business, report)
    except (RefusedError, OSError) as error:
        raise _undo(home, business, entry, error, report) from error
    history = _unique([change.next, *([business.prev] if business.prev else []), *history])
    try:
        files.write_json(home.record_file, dict(entry, state=APPLIED, history=history[:KEPT_RELEASES]))
    except OSError as error:
        raise FailedError(
            f"release {change.next} runs, but that cannot be recorded: {error.strerror}",
            "repair the disk, then deploy again",
        ) from error
    passed("done")
    _collect(home, history[:KEPT_RELEASES])
    secrets.forget(home, but=manifest.secrets)
    passed("collect")
    return {"release": change.next, "previous": prev, "units": systemd.states(manifest.units)}


def _bring(home: Home, change: Change, payload: bytes, report: Report) -> Manifest:
    """The next release, complete under its own name; nothing outside it has changed."""
    if not payload:
        manifest = home.known_manifest(change.next)
        if manifest is None or home.deviations(change.next, manifest):
            raise RefusedError(f"release {change.next} is not on the host", "run the same command again")
        _prove_writable(home)
        return manifest
    manifest, content, found = staging.unpack(payload, change.next, home.kept(change.base))
    staging.check_space(home, manifest)
    _prove_writable(home)
    passed("preflight")
    report.note(f"staging {len(manifest.files)} files")
    folder = staging.stage(home, change.txid, manifest, content, found)
    staging.verify(folder, manifest)
    staging.publish(home, folder, change.next, manifest)
    return manifest


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


def _forward(
    home: Home,
    change: Change,
    manifest: Manifest,
    business: _Business,
    report: Report,
) -> None:
    starting = change.start + change.restart + business.inherited
    stopping = _unique(change.stop + change.restart + business.inherited)
    if stopping:
        report.note(f"stopping {_named(stopping)}")
        systemd.stop(stopping)
    passed("stop")
    files.point(home.current_link, "releases/" + change.next)
    passed("flip")
    system_links.put_links(home, manifest)
    passed("links")
    system_links.put_blocks(home, change.next, manifest)
    passed("blocks")
    systemd.reload(home, business.reload)
    passed("reload")
    units = [unit for unit in manifest.units if unit in starting]
    if units:
        report.note(f"starting {_named(units)}")
        unit_start.start(units)
    passed("start")


def _undo(
    home: Home, business: _Business, entry: dict[str, Any], cause: Exception, report: Report
) -> FailedError:
    """Goes back to the release before, and starts again what ran before. Returns the error to report."""
    report.note(f"undoing: {cause}")
    try:
        _back(home, business)
    except (RefusedError, OSError) as error:
        return FailedError(
            "{}; going back to release {} failed too: {}".format(cause, business.prev or "none", error),
            "the host is between two releases: fix the cause, then deploy again",
        )
    files.write_json(home.record_file, dict(entry, state=UNDONE, error=str(cause)))
    what = f"release {business.prev} runs again" if business.prev else "the host is as before"
    return FailedError(f"{cause}; undone, {what}", getattr(cause, "hint", ""))


def _back(home: Home, business: _Business) -> None:
    manifest = home.manifest(business.prev)
    systemd.stop(business.touched)
    passed("undo-stop")
    if business.prev is None:
        files.remove(home.current_link)
        files.sync(home.path)
    else:
        files.point(home.current_link, "releases/" + business.prev)
    passed("undo-flip")
    changed = system_links.put_links(home, manifest) + system_links.put_blocks(home, business.prev, manifest)
    secrets.forget(home, but=manifest.secrets)
    passed("undo-outside")
    systemd.reload(home, _unique(business.reload + _daemons_of(changed)))
    again = set(business.touched) & set(business.active)
    unit_start.start([unit for unit in manifest.units if unit in again])


def _entry(change: Change, business: _Business, history: list[str]) -> dict[str, Any]:
    with open("/proc/sys/kernel/random/boot_id", encoding="ascii") as file:
        boot = file.read().strip()
    return {
        "txid": change.txid,
        "who": change.who,
        "boot_id": boot,
        "prev": business.prev,
        "next": change.next,
        "touched": business.touched,
        "active": business.active,
        "reload": business.reload,
        "history": history,
    }


def _stale_daemons(before: Manifest | None, after: Manifest) -> list[str]:
    """Returns the daemons that read a file through ``current`` whose content changes."""
    if before is None:
        return ["systemd", "udev"]
    changed = [
        path
        for path in set(before.links) & set(after.links)
        if before.files[before.links[path]] != after.files[after.links[path]]
    ]
    return _daemons_of(changed)


def _daemons_of(paths: Sequence[str]) -> list[str]:
    return [name for name, folder in READERS.items() if any(path.startswith(folder) for path in paths)]


def _collect(home: Home, kept: Sequence[str]) -> None:
    """Removes old releases, never the current one."""
    for digest in home.releases():
        if digest not in kept and digest != home.current():
            shutil.rmtree(home.release(digest), ignore_errors=True)


def _unique(names: Sequence[str]) -> list[str]:
    return list(dict.fromkeys(names))


def _named(units: Sequence[str]) -> str:
    """One or two names; more are counted."""
    return " and ".join(units) if len(units) <= 2 else f"{len(units)} units"


def withdraw(home: Home, report: Report) -> None:
    """Take the swarm off the host: units stopped, links and blocks gone, folder removed. The lock is held."""
    current = home.current()
    manifest = home.known_manifest(current)
    touched = home.record().get("touched", []) if home.record().get("state") == OPEN else []
    linked = [os.path.basename(path) for path in system_links.link_deviations(home, {})]
    units = _unique(
        (manifest.units if manifest else []) + touched + [n for n in linked if n.endswith(".service")]
    )
    report.detach()
    if units:
        report.note(f"stopping {_named(units)}")
        systemd.stop(units)
    nothing = home.manifest(None)
    changed = system_links.put_links(home, nothing) + system_links.put_blocks(home, None, nothing)
    secrets.forget(home)
    passed("withdraw")
    systemd.reload(home, _daemons_of(changed))
    systemd.forget(units)
    files.remove(home.current_link)
    shutil.rmtree(home.path)
    root = os.path.dirname(home.path)
    if set(os.listdir(root)) <= {
        os.path.basename(AGENT_FOLDER)
    }:  # no other swarm needs the agent that is kept here
        shutil.rmtree(root)
