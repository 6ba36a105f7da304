"""The unit that undoes an interrupted change at boot: its file, its link, its code, the record it reads."""

from __future__ import annotations

import os
import zipfile

from swarm_onboard.agent import files, record, recovery_unit, systemd
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.host_checks import Judged, override

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Iterator

    from swarm_onboard.agent.release_store import Home

TABLE = (
    (
        "the unit that undoes a change at boot is masked, changed, not linked, or lacks its code or record",
        "a warning, since the next change writes it anew; unhealthy while a change is open",
    ),
    ("a drop-in changes how that unit starts or ends", "a warning; unhealthy while a change is open"),
)


class Seen(NamedTuple):
    """What the unit lacks, in words, and whether a change is open that it may have to undo.

    ``drop_ins``: what drop-ins change in it, which the next deploy leaves.
    """

    unit: str
    lacks: list[str]
    drop_ins: list[str]
    open: bool


def observe(home: Home) -> list[Seen]:
    """Compares the unit with the one that this agent writes; nothing without a release."""
    if home.current() is None:
        return []
    unit, text = recovery_unit.name(home), recovery_unit.unit_text(home).encode("utf-8")
    shown = systemd.properties([unit], ("Id", "DropInPaths")).get(unit, {})
    changes = override.overridden(home, text, shown.get("DropInPaths", "").split())
    drop_ins = [f"is changed: {one}" for one in changes]
    return [Seen(unit, list(_lacks(home)), drop_ins, os.path.exists(home.open_mark))]


def _lacks(home: Home) -> Iterator[str]:
    unit, link = recovery_unit.paths(home)
    place = home.outside(unit)
    if os.path.realpath(place) == os.devnull:
        yield "is masked"
    elif not os.path.isfile(place):
        yield "does not exist"
    elif files.read(place) != recovery_unit.unit_text(home).encode("utf-8"):
        yield "was changed, or is of another version of swarmctl"
    if files.pointed(home.outside(link)) != unit:
        yield "does not start at boot: its link is missing"
    if not _is_whole(home.recovery_code):
        yield f"cannot run: {home.recovery_code} is missing or damaged"
    if not record.read(home).state:
        yield f"does not know what to undo: {home.record_file} is missing or damaged"


def _is_whole(archive: str) -> bool:
    """Whether each file of the archive has its checksum. It may be of another version of swarmctl."""
    try:
        with zipfile.ZipFile(archive) as code:
            return code.testzip() is None and any("agent/recovery.py" in name for name in code.namelist())
    except (OSError, zipfile.BadZipFile, NotImplementedError):
        return False


def judge(seen: Seen, host: str) -> Judged:
    """Names what keeps a host from undoing a change at boot."""
    if not seen.lacks and not seen.drop_ins:
        return Judged("ok", f"{seen.unit} is ready")
    what = ", ".join([*seen.lacks, *seen.drop_ins])
    text = f"{seen.unit} {what}: a change that is interrupted is not undone at boot"
    if seen.drop_ins:
        hint = f"on {host}, remove the drop-in, then: sudo systemctl daemon-reload"
        return Judged("bad" if seen.open else "warning", text, hint)
    if seen.open:
        return Judged("bad", text, f"run swarmctl deploy, which settles the open change of {host}")
    return Judged("warning", text, "the next deploy that changes the host writes it anew")
