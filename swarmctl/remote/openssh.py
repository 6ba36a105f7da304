"""SSH sessions with the program ``ssh``, for hosts and keys that paramiko does not know: the same promises.

Host keys are compared with the pinned ones alone, at each hop; no password logs in; every wait has a limit.
Each connection is one process, which its sessions share; all hosts behind a jump host share that of the hop.
"""

from __future__ import annotations

import os
import shutil
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from swarmctl.remote import openssh_options as options
from swarmctl.remote.identities import DEFAULT_FILES, SECURITY_KEY_FILES
from swarmctl.remote.jump_hosts import Hops
from swarmctl.remote.openssh_log import Stage
from swarmctl.remote.openssh_process import LoginFolders, SshProcess, write_private
from swarmctl.remote.openssh_session import OpenSshSession
from swarmctl.remote.ssh_limits import Timeouts, patiently
from swarmctl.remote.sudo_password import SudoPassword
from swarmctl.remote.transport import HostError, Kind, Target

PROGRAM = "ssh"
_TOUCH = 60.0  # s that a person has to touch a security key


@dataclass(frozen=True)
class Connection:
    """A connection: its process and its files."""

    process: SshProcess
    files: options.Files


class OpenSshTransport:
    """Opens sessions with ``ssh``. Safe to share between threads."""

    def __init__(
        self,
        home: Path | None = None,
        *,
        use_agent: bool = True,
        timeouts: Timeouts | None = None,
        attempts: int = 4,
        sudo: SudoPassword | None = None,
        note: Callable[[str], None] = lambda _: None,
    ) -> None:
        """``home``: the folder ``.ssh`` of the operator; ``note`` gets what a person has to do.

        ``sudo``: for hosts on which the account becomes root with a password only.
        """
        self._home = home if home is not None else Path.home() / ".ssh"
        self._use_agent = use_agent
        self._timeouts = timeouts or Timeouts()
        self._attempts = attempts
        self._sudo = sudo
        self._note = note
        self._hops = Hops(self._login, lambda connection: connection.process.alive)
        self._lock = threading.Lock()
        self._made: LoginFolders | None = None

    @contextmanager
    def connect(self, target: Target) -> Iterator[OpenSshSession]:
        """Connect, compare the host key, log in; closed on leaving."""
        with self._login(target) as connection:
            yield OpenSshSession(connection.process, connection.files.control, target.host, self._sudo)

    def scan(self, target: Target) -> str:
        """The public key that ``target`` shows, unchecked, of a type in ``keys`` if it has one.

        Logs in to jump hosts only.
        """
        with self._way(target) as way:
            return patiently(self._attempts, lambda: self._shown(target, way))

    @contextmanager
    def _login(self, target: Target) -> Iterator[Connection]:
        with self._way(target) as way:
            connection = patiently(self._attempts, lambda: self._logged_in(target, way))
            try:
                yield connection
            finally:
                self._close(connection)

    @contextmanager
    def _way(self, target: Target) -> Iterator[str]:
        """The command that leads to the host; empty for a TCP connection."""
        if target.jump is None:
            yield target.proxy_command
        else:
            with self._hops.through(target.jump) as hop:
                yield options.through(target.jump, hop.files, program())

    def _logged_in(self, target: Target, way: str) -> Connection:
        connection = self._started(target, way, scan=False)
        try:
            error = self._outcome(connection, target, way)
            if error is not None:
                raise error
        except BaseException:
            self._close(connection)
            raise
        return connection

    def _shown(self, target: Target, way: str) -> str:
        connection = self._started(target, way, scan=True)
        try:
            error = self._outcome(connection, target, way)
            if key := connection.files.shown_key():
                return key
        finally:
            self._close(connection)
        if error is None or error.kind is Kind.HOST_KEY:
            raise HostError(
                Kind.UNREACHABLE,
                f"{target.host}: this ssh does not show host keys",
                "update OpenSSH on this machine (8.5 or newer), or write the key to the known_hosts file "
                "beside the spec by hand",
            )
        raise error

    def _outcome(self, connection: Connection, target: Target, way: str) -> HostError | None:
        """Waits for the end of a login; the error if it failed."""
        limits = self._timeouts
        late, waited = connection.process.await_login(
            {
                # Behind a command it cannot be seen when the connection is there.
                Stage.CONNECT: limits.connect + limits.banner if way else limits.connect,
                Stage.BANNER: limits.banner,
                Stage.HANDSHAKE: limits.auth,
                Stage.LOGIN: limits.auth,
                Stage.TOUCH: _TOUCH,
            },
            on_touch=lambda: self._note(f"touch the security key to log in to {target.host}"),
        )
        if connection.process.log.stage is Stage.DONE:
            return None
        return connection.process.log.error(target, connection.process.printed, waited, late=late)

    def _started(self, target: Target, way: str, *, scan: bool) -> Connection:
        ssh = program()
        folders = self._folders(ssh)
        files = options.Files(folders.new())
        try:
            text = options.configuration(
                target,
                files,
                home=self._home,
                identities=self._identities(target),
                use_agent=self._use_agent,
                way=way,
                connect=self._timeouts.connect,
                acknowledgement=self._timeouts.acknowledgement,
                scan=scan,
            )
            write_private(files.configuration, text)
            write_private(files.known_hosts, options.known_hosts(target))
            argv = [ssh, "-F", str(files.configuration), "-E", str(files.log), "-N", "--", target.host]
            return Connection(SshProcess(argv, files.log, _environment()), files)
        except BaseException:
            folders.remove(files.folder)
            raise

    def _identities(self, target: Target) -> tuple[Path, ...]:
        if target.identities:
            return tuple(path.expanduser() for path in target.identities)
        return tuple(
            path for name in (*DEFAULT_FILES, *SECURITY_KEY_FILES) if (path := self._home / name).is_file()
        )

    def _folders(self, ssh: str) -> LoginFolders:
        with self._lock:
            self._made = self._made or LoginFolders(ssh)
            return self._made

    def _close(self, connection: Connection) -> None:
        connection.process.close()
        if self._made is not None:
            self._made.remove(connection.files.folder)


def program() -> str:
    """Where ``ssh`` is. Raises ``HostError`` if it is not installed."""
    if found := shutil.which(PROGRAM):
        return found
    raise HostError(
        Kind.UNREACHABLE,
        "the program `ssh` is not installed on this machine",
        "install it: `apt install openssh-client`",
    )


def _environment() -> dict[str, str]:
    """English messages, and no window that asks for anything."""
    return {**os.environ, "LC_ALL": "C", "SSH_ASKPASS_REQUIRE": "never"}
