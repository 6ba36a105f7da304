"""Opens sessions with paramiko, and with the program ``ssh`` where paramiko is known not to be able to.

A wrong host key, or a handshake that fails for another reason than its algorithms, is never tried again.
"""

from __future__ import annotations

import os
import shutil
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from enum import Enum
from typing import TYPE_CHECKING, TypeVar

from swarmctl.remote.identities import Keyring
from swarmctl.remote.ssh import SshTransport
from swarmctl.remote.ssh_errors import NoCommonAlgorithmError
from swarmctl.remote.sudo_password import SudoPassword
from swarmctl.remote.transport import ChannelSession, HostError, Kind, Target

if TYPE_CHECKING:
    from swarmctl.remote.openssh import OpenSshTransport

VARIABLE = "SWARMCTL_SSH"

_INSTALL = "the program `ssh` may be able to, and is not installed here (`apt install openssh-client`)"

R = TypeVar("R")


class Choice(str, Enum):
    """The values of ``SWARMCTL_SSH``."""

    EITHER = "auto"
    PARAMIKO = "paramiko"
    OPENSSH = "openssh"


def chosen() -> Choice:
    """What the environment chooses. Raises ``ValueError`` for anything else."""
    return Choice(os.environ.get(VARIABLE) or Choice.EITHER.value)


class EitherSsh:
    """Both transports in one. Safe to share between threads."""

    def __init__(
        self,
        choice: Choice = Choice.EITHER,
        keyring: Keyring | None = None,
        *,
        sudo: SudoPassword | None = None,
        note: Callable[[str], None] = lambda _: None,
    ) -> None:
        """``note`` gets one line for each reason why the program ``ssh`` is used."""
        self._choice = choice
        self._keyring = keyring or Keyring()
        self._note = note
        self._paramiko = SshTransport(self._keyring, sudo=sudo)
        self._sudo = sudo
        self._made: OpenSshTransport | None = None
        self._lock = threading.Lock()
        self._reasons: dict[str, str] = {}
        self._noted: set[str] = set()

    @contextmanager
    def connect(self, target: Target) -> Iterator[ChannelSession]:
        """Connect, compare the host key, log in; closed on leaving. Raises ``HostError``."""
        with ExitStack() as stack:

            def paramiko() -> ChannelSession:
                return stack.enter_context(self._paramiko.connect(target))

            def openssh() -> ChannelSession:
                return stack.enter_context(self._openssh().connect(target))

            yield self._try(target, paramiko, openssh)

    def scan(self, target: Target) -> str:
        """See ``SshTransport.scan``."""
        return self._try(target, lambda: self._paramiko.scan(target), lambda: self._openssh().scan(target))

    def uses_paramiko(self, target: Target) -> bool:
        """Returns True if paramiko is what connects to a host, as far as is known."""
        known = self._choice is Choice.OPENSSH or target.host in self._reasons or needs_program(target)
        return not known and not any(one.expelled for one in target.way())

    def _try(self, target: Target, paramiko: Callable[[], R], openssh: Callable[[], R]) -> R:
        if expelled := next((one.host for one in target.way() if one.expelled), ""):
            raise HostError(
                Kind.UNREACHABLE,
                f"{expelled} was expelled from the swarm, and swarmctl does not log in to it",
                f"remove it from the spec; or set it up anew: `swarmctl trust --host {expelled} --replace`",
            )
        if self._choice is Choice.PARAMIKO:
            return paramiko()
        if self._choice is Choice.OPENSSH:
            return openssh()
        reason = self._reasons.get(target.host) or needs_program(target)
        if not reason:
            try:
                return paramiko()
            except HostError as error:
                reason = self.beyond_paramiko(error, target)
                if not reason:
                    raise
                if not shutil.which("ssh"):
                    raise HostError(error.kind, error.message, f"{error.hint}; {_INSTALL}") from error
        self._remember(target, reason)
        return openssh()

    def beyond_paramiko(self, error: HostError, target: Target) -> str:
        """Why ``ssh`` may succeed where paramiko has failed; empty if nothing is known that it could do."""
        if self._choice is Choice.PARAMIKO:
            return ""
        if isinstance(error, NoCommonAlgorithmError):
            return "paramiko has none of the algorithms that it offers"
        if error.kind is not Kind.AUTH:
            return ""
        if "gssapi" in error.message:
            return "it wants Kerberos (GSSAPI)"
        found = (
            f"`{one.ssh_only[0]}` in ~/.ssh/config"
            if one.ssh_only
            else self._keyring.beyond_paramiko(one.identities)
            for one in target.way()
        )
        return next(filter(None, found), "")

    def _remember(self, target: Target, reason: str) -> None:
        with self._lock:
            self._reasons[target.host] = reason
            new = reason not in self._noted
            self._noted.add(reason)
        if new:
            self._note(f"{target.host} is reached with the program `ssh`: {reason}")

    def _openssh(self) -> OpenSshTransport:
        from swarmctl.remote.openssh import OpenSshTransport  # noqa: PLC0415  (few swarms need it)

        with self._lock:
            self._made = self._made or OpenSshTransport(
                self._keyring.home, use_agent=self._keyring.use_agent, sudo=self._sudo, note=self._note
            )
            return self._made


def needs_program(target: Target) -> str:
    """Why paramiko need not be tried; empty if it may succeed."""
    return "`ProxyCommand` in ~/.ssh/config" if any(one.proxy_command for one in target.way()) else ""
