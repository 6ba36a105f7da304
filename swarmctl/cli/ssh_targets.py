"""Puts together how the hosts of a swarm are reached: the spec, ``~/.ssh/config`` and the pinned keys."""

from __future__ import annotations

import getpass
import os
import sys
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from swarmctl.cli import console, exit_codes

if TYPE_CHECKING:
    from swarmctl.remote.either_ssh import Choice, EitherSsh
    from swarmctl.remote.identities import Keyring
    from swarmctl.remote.known_hosts import KnownHosts
    from swarmctl.remote.ssh_config import Login
    from swarmctl.remote.sudo_password import SudoPassword
    from swarmctl.remote.transport import Target
    from swarmctl.spec.reach import HostLogin

SUDO_PASSWORD_FILE = "SWARMCTL_SUDO_PASSWORD_FILE"
_PATIENCE, _URGENT = 300.0, 1.0  # s that a pipe has to give the password


class NamedHosts(Protocol):
    """Anything with hosts to log in to."""

    @property
    def name(self) -> str:
        """The name of the swarm."""

    @property
    def hosts(self) -> Mapping[str, HostLogin]:
        """Its hosts by name."""


def transport(*, urgent: bool = False, become: bool = True) -> EitherSsh:
    """Connections from this process; to ``become`` root, with the password of ``sudo`` if there is one.

    Ends the program if its file is wrong; if ``urgent``, goes on without the password, with a warning.
    """
    from swarmctl.remote.either_ssh import EitherSsh

    name = os.environ.get(SUDO_PASSWORD_FILE)
    sudo = _sudo_password(name, urgent) if name and become else None
    return EitherSsh(choice(), keyring(), sudo=sudo, note=_note)


def choice() -> Choice:
    """Which SSH the environment chooses; ends the program if it names none."""
    from swarmctl.remote import either_ssh

    try:
        return either_ssh.chosen()
    except ValueError:
        values = ", ".join(one.value for one in either_ssh.Choice)
        console.fail(
            f"{either_ssh.VARIABLE}={os.environ[either_ssh.VARIABLE]}: it is one of {values}",
            code=exit_codes.USAGE,
        )


def _note(text: str) -> None:
    from swarmctl.views.escape import printable

    console.err().print(f"note: {printable(text)}")


def keyring() -> Keyring:
    """The private keys of the operator."""
    return _keyring(Path.home())


@cache  # one prompt for each key
def _keyring(home: Path) -> Keyring:
    from swarmctl.remote.identities import Keyring

    return Keyring(home / ".ssh")


def ask_passphrases(targets: Iterable[Target]) -> None:
    """Asks for the passphrases of the keys to log in with, on a terminal; an empty answer leaves one out."""
    from swarmctl.remote.either_ssh import Choice, needs_program

    if choice() is Choice.OPENSSH or not (sys.stdin.isatty() and sys.stderr.isatty()):
        return  # ssh takes keys with a passphrase from ssh-agent alone
    hosts = [one for target in targets if not needs_program(target) for one in target.way()]
    locked = [path for paths in {one.identities for one in hosts} for path in keyring().locked(paths)]
    for path in locked:
        _ask_passphrase(path)


@cache
def _ask_passphrase(path: Path) -> None:
    while passphrase := getpass.getpass(f"Passphrase of {path}: "):
        if keyring().unlock(path, passphrase):
            return
        console.err().print(f"this is not the passphrase of {path}; Enter goes on without this key")


@cache  # a pipe can be read once
def _sudo_password(name: str, urgent: bool) -> SudoPassword | None:
    from swarmctl.remote.sudo_password import from_file

    try:
        return from_file(Path(name), _URGENT if urgent else _PATIENCE)
    except (OSError, ValueError) as error:  # of a ValueError the text may quote the file
        reason = error.strerror if isinstance(error, OSError) else "its first line is not a password"
        place = f"{SUDO_PASSWORD_FILE}={name}"
        if urgent:
            console.err().print(f"warning: {place}: {reason}; going on without a password")
            return None
        console.fail(f"{place}: {reason}", "it names a file whose first line is the password")


def read_known_hosts(spec: Path) -> KnownHosts:
    """The pinned keys beside the spec; ends the program if the file is wrong."""
    from swarmctl.remote import known_hosts
    from swarmctl.remote.openssh_files import OpenSshFileError

    try:
        return known_hosts.read(known_hosts.path_beside(spec))
    except OpenSshFileError as error:
        console.fail(str(error), "correct the line, or remove the file and run `swarmctl trust` again")


def known_elsewhere() -> KnownHosts:
    """What ``~/.ssh/known_hosts`` has; nothing, with a warning, if it cannot be read."""
    from swarmctl.remote.known_hosts import KnownHosts, read_valid_lines
    from swarmctl.remote.openssh_files import OpenSshFileError

    try:
        return read_valid_lines(Path.home() / ".ssh" / "known_hosts")
    except OpenSshFileError as error:
        console.err().print(f"warning: {error}; new keys are not compared with it")
        return KnownHosts()


def targets(swarm: NamedHosts, known: KnownHosts) -> tuple[Mapping[str, Target], tuple[str, ...]]:
    """How to reach every host, by name, and what in ``~/.ssh/config`` is ignored; asks for passphrases.

    Ends the program if that file is wrong.
    """
    found, warnings = resolved(swarm, known)
    ask_passphrases(found.values())
    return found, (*warnings, *_unused(found.values()))


def resolved(swarm: NamedHosts, known: KnownHosts) -> tuple[Mapping[str, Target], tuple[str, ...]]:
    """The same for the program ``ssh``, which uses all of that file and asks itself."""
    from swarmctl.remote.openssh_files import OpenSshFileError
    from swarmctl.remote.ssh_config import Resolver, SshConfig

    home = Path.home()
    config = SshConfig(home / ".ssh" / "config")
    resolver = Resolver(config, known, getpass.getuser(), home)
    try:
        found = {name: resolver.target(login(swarm, name)) for name in swarm.hosts}
    except OpenSshFileError as error:
        console.fail(
            str(error), "swarmctl reads `~/.ssh/config` as ssh does; `ssh -G HOST` reports the same line"
        )
    return found, tuple(config.warnings)


def _unused(targets: Iterable[Target]) -> Iterator[str]:
    """What in ``~/.ssh/config`` paramiko alone cannot use."""
    from swarmctl.remote.either_ssh import Choice

    if choice() is Choice.PARAMIKO:
        for target in targets:
            if target.proxy_command:
                yield f"{target.host}: ProxyCommand in ~/.ssh/config is ignored with SWARMCTL_SSH=paramiko"


def login(swarm: NamedHosts, name: str, behind: tuple[str, ...] = ()) -> Login:
    """What the spec declares about reaching a host; a circle of ``via`` is cut where it closes."""
    from swarmctl.remote.ssh_config import Login

    host = swarm.hosts[name]
    via = None if host.via is None or host.via in (*behind, name) else login(swarm, host.via, (*behind, name))
    return Login(
        name,
        host.address,
        host.user if "user" in host.declared else None,
        host.port if "port" in host.declared else None,
        via,
        default_user=host.user,
    )
