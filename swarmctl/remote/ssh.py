"""SSH sessions: host keys are compared first, only public keys log in, every wait has a limit."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from threading import Lock
from typing import Any

from swarmctl.remote.identities import Identity, Keyring
from swarmctl.remote.jump_hosts import Hops
from swarmctl.remote.lean_paramiko import paramiko
from swarmctl.remote.ssh_channel import SshSession
from swarmctl.remote.ssh_errors import (
    closed_login,
    dropped,
    failed_handshake,
    no_banner,
    no_common_algorithm,
    no_private_key,
    no_public_keys,
    no_way_through_hop,
    rejected,
    silent_login,
    stalled_handshake,
    with_fingerprint,
    wrong_host_key,
)
from swarmctl.remote.ssh_limits import Timeouts, patiently
from swarmctl.remote.sudo_password import SudoPassword
from swarmctl.remote.tcp import PromptSocket, dial
from swarmctl.remote.transport import HostError, Target

_WEAK = {
    "ciphers": ["3des-cbc", "aes128-cbc", "aes192-cbc", "aes256-cbc"],
    "macs": ["hmac-md5", "hmac-md5-96", "hmac-sha1", "hmac-sha1-96"],
}
# Of which list paramiko found nothing acceptable, by a word of its error.
_OFFERS = {
    "host key": "server_key_algo_list",
    "kex": "kex_algo_list",
    "ciphers": "server_encrypt_algo_list",
    "macs": "server_mac_algo_list",
}
# The name of a key type on file and of the signatures made with it differ for RSA only.
_SIGNATURES = {"ssh-rsa": ("rsa-sha2-512", "rsa-sha2-256")}
_NO_REPLY = "Authentication timeout."  # how paramiko distinguishes it from a rejection
_LOG = "swarmctl.remote.ssh"
logging.getLogger(_LOG).addHandler(logging.NullHandler())
logging.getLogger(_LOG).propagate = False  # paramiko's debug lines can carry data


class SshTransport:
    """Opens sessions with paramiko. Safe to share between threads."""

    def __init__(
        self,
        keyring: Keyring | None = None,
        *,
        timeouts: Timeouts | None = None,
        attempts: int = 4,
        sudo: SudoPassword | None = None,
    ) -> None:
        """``sudo``: for hosts on which the account becomes root with a password only."""
        self._keyring = keyring or Keyring()
        self._timeouts = timeouts or Timeouts()
        self._attempts = attempts
        self._sudo = sudo
        self._hops = Hops(self._login, paramiko.Transport.is_active)

    @contextmanager
    def connect(self, target: Target) -> Iterator[SshSession]:
        """Connect, compare the host key, log in; closed on leaving."""
        with self._login(target) as client:
            yield SshSession(client, target.host, self._sudo)

    def scan(self, target: Target) -> str:
        """The public key that ``target`` shows, unchecked, of a type in ``keys`` if it has one.

        Logs in to jump hosts only.
        """
        with self._handshake(target) as client:
            return _public(client.get_remote_server_key())

    @contextmanager
    def _login(self, target: Target) -> Iterator[paramiko.Transport]:
        with self._handshake(target) as client:
            _compare(target, _public(client.get_remote_server_key()))
            self._authenticate(client, target)
            yield client

    @contextmanager
    def _handshake(self, target: Target) -> Iterator[paramiko.Transport]:
        """A connection after the key exchange, without login."""
        with self._route(target) as route:
            client = patiently(self._attempts, lambda: _exchange_keys(route.open(), target, self._timeouts))
            try:
                yield client
            finally:
                client.close()

    @contextmanager
    def _route(self, target: Target) -> Iterator[_Route]:
        if target.jump is None:
            yield _Route(target, None, self._timeouts)
        else:
            with self._hops.through(target.jump) as hop:
                yield _Route(target, hop, self._timeouts)

    def _authenticate(self, client: paramiko.Transport, target: Target) -> None:
        identities = self._keyring.identities(target.identities)
        if not identities:
            raise no_private_key(target)
        for identity in identities:
            if _accepted(client, target, identity):
                return
        raise rejected(target, [identity.name for identity in identities])


@dataclass(frozen=True)
class _Route:
    """The connection to a host's SSH port: direct, or through a jump host that is logged in already."""

    target: Target
    hop: paramiko.Transport | None
    timeouts: Timeouts

    def open(self) -> PromptSocket | HopSocket:
        target = self.target
        if self.hop is None:
            limits = self.timeouts
            return dial(target, limits.connect, acknowledgement=limits.acknowledgement)
        try:
            channel = self.hop.open_channel(
                "direct-tcpip",
                (target.address, target.port),
                ("127.0.0.1", 0),
                timeout=self.timeouts.channel,
            )
            return HopSocket(channel)
        except (paramiko.SSHException, EOFError, OSError) as error:
            raise no_way_through_hop(target, str(error)) from error


class HopSocket:
    """A channel through a jump host, as a socket on which nothing is sent after it was closed.

    `paramiko.Channel` sends what a thread has begun to send after another one has closed it. sshd ends the
    whole connection for that ("data packet referred to nonexistent channel"), with all hosts behind the hop.
    """

    def __init__(self, channel: paramiko.Channel) -> None:
        self._channel = channel
        self._lock = Lock()

    def send(self, data: bytes) -> int:
        """Sends some of ``data``; returns how many bytes. Raises ``OSError``."""
        with self._lock:
            return self._channel.send(data)

    def close(self) -> None:
        """Closes the channel once what is being sent was sent."""
        with self._lock:
            self._channel.close()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._channel, name)


class _Client(paramiko.Transport):
    """Keeps what a host offers, for the error about one that is too old."""

    _offers: dict[str, list[str]] = {}  # noqa: RUF012  (replaced, never changed)

    def _really_parse_kex_init(self, *args: Any, **options: Any) -> dict[str, Any]:
        self._offers = super()._really_parse_kex_init(*args, **options)  # type: ignore[misc]
        return self._offers

    def offered(self, complaint: str) -> str:
        """The algorithms of the kind that paramiko's ``complaint`` is about, or the complaint."""
        kinds = (key for word, key in _OFFERS.items() if word in complaint)
        return ", ".join(self._offers.get(next(kinds, ""), ())) or complaint


def _exchange_keys(route: PromptSocket | HopSocket, target: Target, timeouts: Timeouts) -> paramiko.Transport:
    client = _Client(route, disabled_algorithms=_WEAK)  # type: ignore[arg-type]  # as much of a socket as it uses
    client.set_log_channel(_LOG)
    client.banner_timeout = timeouts.banner
    client.handshake_timeout = timeouts.auth
    client.auth_timeout = timeouts.auth
    client.channel_timeout = timeouts.channel
    options = client.get_security_options()
    options.key_types = _preferred(tuple(options.key_types), target.keys)
    begun = time.monotonic()
    try:
        client.start_client(timeout=timeouts.banner + timeouts.auth)
        if not client.initial_kex_done:
            raise TimeoutError
    except BaseException as error:
        greeted = bool(client.remote_version)
        client.close()
        # paramiko reports the end of its own waits as the end of the connection.
        late = time.monotonic() - begun >= min(timeouts.banner, timeouts.auth)
        if isinstance(error, paramiko.SSHException | EOFError | OSError):
            if isinstance(error, paramiko.ssh_exception.IncompatiblePeer):
                raise no_common_algorithm(target, client.offered(str(error)), program=False) from error
            raise _handshake_error(error, target, late=late, greeted=greeted) from error
        raise
    return client


def _handshake_error(error: Exception, target: Target, *, late: bool, greeted: bool) -> HostError:
    """``late``: a time limit ended it; ``greeted``: the host has sent its SSH banner."""
    if late:
        return stalled_handshake(target) if greeted else no_banner(target)
    if isinstance(error, EOFError | OSError) or "banner" in str(error):
        return dropped(target, greeted=greeted)
    return failed_handshake(target, str(error))


def _preferred(supported: tuple[str, ...], pinned: tuple[str, ...]) -> tuple[str, ...]:
    """The key types to ask for, pinned ones first: a host with several keys then shows the pinned one."""
    types = [key.split(maxsplit=1)[0] for key in pinned]
    wanted = [name for kind in types for name in _SIGNATURES.get(kind, (kind,)) if name in supported]
    return tuple(dict.fromkeys([*wanted, *supported]))


def _public(key: paramiko.PKey) -> str:
    return f"{key.get_name()} {key.get_base64()}"


def _compare(target: Target, shown: str) -> None:
    """Raises ``HostError`` if a host's key is not one of the pinned ones, or is revoked."""
    revoked = shown in target.revoked
    if revoked or shown not in target.keys:
        raise wrong_host_key(target, with_fingerprint(shown), revoked=revoked)


def _accepted(client: paramiko.Transport, target: Target, identity: Identity) -> bool:
    """True if the host accepts this key."""
    try:
        return not client.auth_publickey(target.user, identity.key)
    except paramiko.BadAuthenticationType as error:
        if "publickey" in error.allowed_types:  # the key was accepted; the host requires a second factor
            return False
        raise no_public_keys(target, error.allowed_types) from error
    except paramiko.AuthenticationException as error:
        if str(error) == _NO_REPLY:
            raise silent_login(target, f"{client.auth_timeout:g} s passed") from error
        if client.is_active():
            return False
        raise closed_login(target) from error
    except (paramiko.SSHException, EOFError, OSError) as error:
        raise silent_login(target, str(error)) from error
