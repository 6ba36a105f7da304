"""A change of nothing but files that no unit, daemon or login uses: the host is old or new at one rename.

Nothing that runs notices it, so it cannot lock anybody out, and it stays without a confirmation. Whatever
ends the agent, or the power, ``current`` says whether it took place, and there is nothing to undo.
"""

from __future__ import annotations

from . import closing, files, record, system_links
from .change import Change
from .errors import RefusedError
from .failpoint import passed
from .manifest import EMPTY, Manifest
from .record import Record
from .release_store import Home
from .rpc import Report


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
    closing.keep(home, begun)


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
