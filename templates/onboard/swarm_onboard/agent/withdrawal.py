"""Takes the swarm off the host. May be interrupted: the recovery unit goes on at the next boot."""

from __future__ import annotations

import os
import shutil
from contextlib import suppress

from . import (
    files,
    record,
    recovery_unit,
    secrets,
    stop_latches,
    system_links,
    systemd,
    trial_units,
    unit_start,
    wireguard_key,
)
from .errors import FailedError
from .failpoint import passed
from .paths import AGENT_FOLDER
from .record import Record
from .release_store import Home
from .transaction import named

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Callable


def withdraw(home: Home, who: str, note: Callable[[str], None] = lambda _: None) -> None:
    """Stops the units, removes links, blocks, secrets and the folder. The lock is held."""
    before = record.read(home)
    manifest = home.known_manifest(home.current())
    linked = [os.path.basename(path) for path in system_links.link_deviations(home, {})]
    units = list(
        dict.fromkeys(
            [
                *(manifest.units if manifest else ()),
                *(before.touched if before.open else ()),
                *(name for name in linked if name.endswith(".service")),
            ]
        )
    )
    with suppress(OSError):  # a swarm can be removed from a full disk, too
        record.write(home, Record(state=record.REMOVING, who=who, touched=tuple(units)))
    passed("removing")
    trial_units.forbid(home, units)
    if units:
        note(f"stopping {named(units)}")
        systemd.stop(units)
    nothing = home.manifest(None)
    changed = system_links.put_links(home, nothing) + system_links.put_blocks(home, None, nothing)
    secrets.point(home, "")
    system_links.remove_folders(home)
    secrets.forget(home)
    wireguard_key.forget(home)
    stop_latches.forget(home)
    passed("withdraw")
    unit_start.reload_daemons(home, system_links.daemons_of(changed))
    systemd.forget(units)
    for name in system_links.foreign_units(home, units):
        note(f"left {name}, which swarmctl did not write")
    _remove_folder(home)


def _remove_folder(home: Home) -> None:
    """Removes the folder under another name: one that is half removed is no swarm.

    The recovery unit goes after it: until then a boot finishes the removal.
    """
    root = os.path.dirname(home.path)
    shutil.rmtree(home.gone, ignore_errors=True)
    os.rename(home.path, home.gone)
    files.sync(root)
    passed("removed")
    recovery_unit.remove(home)
    with suppress(FailedError):  # systemd lists the unit until it reads its files again, or the host boots
        unit_start.reload_daemons(home, ["systemd"])
    shutil.rmtree(home.gone)
    if set(os.listdir(root)) <= {os.path.basename(AGENT_FOLDER)}:  # no other swarm needs the kept agent
        shutil.rmtree(root)
    files.sync_disk(os.path.dirname(root))  # secrets, too, are gone for good
