"""How the hosts of a swarm are reached: the spec, ``~/.ssh/config`` and the pinned keys, put together."""

from __future__ import annotations

import getpass
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from swarmctl.cli import console

if TYPE_CHECKING:
    from swarmctl.remote.hostkeys import LockFile
    from swarmctl.remote.sshconfig import Login
    from swarmctl.remote.transport import Target
    from swarmctl.topology.swarm import Swarm

SSH_PORT = 22


def read_lock(spec: Path) -> LockFile:
    """The pinned keys beside the spec; if that file is wrong, the program ends."""
    from swarmctl.remote import hostkeys

    try:
        return hostkeys.read_lock(hostkeys.lock_path(spec))
    except hostkeys.LockFileError as error:
        console.fail(str(error), "mend it, or remove it and run `swarmctl trust` again")


def targets(swarm: Swarm, lock: LockFile) -> tuple[Mapping[str, Target], tuple[str, ...]]:
    """The way to every host by name, and what of ``~/.ssh/config`` was passed over."""
    from swarmctl.remote import sshconfig

    home, user = Path.home(), getpass.getuser()
    config = sshconfig.load(home / ".ssh" / "config")
    resolved = {
        name: sshconfig.resolve(config, login(swarm, name), lock.hosts, local_user=user, home=home)
        for name in swarm.hosts
    }
    warnings = [*config.warnings, *(text for one in resolved.values() for text in one.warnings)]
    return {name: one.target for name, one in resolved.items()}, tuple(dict.fromkeys(warnings))


def login(swarm: Swarm, name: str, behind: tuple[str, ...] = ()) -> Login:
    """What the spec says about reaching a host; a circle of ``via`` is cut where it closes."""
    from swarmctl.remote.sshconfig import Login

    host = swarm.hosts[name]
    via = None if host.via is None or host.via in (*behind, name) else login(swarm, host.via, (*behind, name))
    return Login(name, host.address, host.user, None if host.port == SSH_PORT else host.port, via)
