"""SSH sessions: host keys are compared first, only public keys log in, every wait has a limit."""

from __future__ import annotations

import logging
import random
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import paramiko

from swarmctl.remote.identities import Identity, Keyring
from swarmctl.remote.jump_hosts import Hops
from swarmctl.remote.known_hosts import fingerprint
from swarmctl.remote.ssh_channel import CHANNEL_TIMEOUT, SshSession
from swarmctl.remote.sudo_password import SudoPassword
from swarmctl.remote.tcp import PromptSocket, dial
from swarmctl.remote.transport import HostError, Kind, Target

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
_MOST_QUOTED = 200  # characters of what a host sends instead of SSH
_LOG = "swarmctl.remote.ssh"
logging.getLogger(_LOG).addHandler(logging.NullHandler())
logging.getLogger(_LOG).propagate = False  # paramiko's debug lines can carry data


@dataclass(frozen=True)
class Timeouts:
    """Time limits of a login, in seconds."""

    connect: float = 10.0
    banner: float = 10.0
    auth: float = 15.0
    channel: float = CHANNEL_TIMEOUT
    acknowledgement: float = 15.0  # of what was sent; then the connection counts as lost


@dataclass(unsafe_hash=True)
class _DroppedError(HostError):
    """Closed before the SSH banner, as sshd does beyond its ``MaxStartups``."""


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
        self._hops = Hops(self._login)

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
            client = self._negotiate(route, target)
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

    def _negotiate(self, route: _Route, target: Target) -> paramiko.Transport:
        attempt = 1
        while True:
            try:
                return _exchange_keys(route.open(), target, self._timeouts)
            except _DroppedError:
                if attempt == self._attempts:
                    raise
            time.sleep(random.uniform(0.2, 0.6) * attempt)
            attempt += 1

    def _authenticate(self, client: paramiko.Transport, target: Target) -> None:
        identities = self._keyring.identities(target.identities)
        if not identities:
            raise HostError(
                Kind.AUTH,
                f"there is no private key to log in to {target.host} with",
                "create one with `ssh-keygen -t ed25519`, copy it to the host with "
                f"`ssh-copy-id {target.user}@{target.address}`",
            )
        for identity in identities:
            if _accepted(client, target, identity):
                return
        tried = ", ".join(identity.name for identity in identities)
        raise HostError(
            Kind.AUTH,
            f"{target.host} rejected the login of {target.user}; tried {tried}",
            f"`ssh-copy-id -i KEY -p {target.port} {target.user}@{target.address}` authorises a key",
        )


@dataclass(frozen=True)
class _Route:
    """The connection to a host's SSH port: direct, or through a jump host that is logged in already."""

    target: Target
    hop: paramiko.Transport | None
    timeouts: Timeouts

    def open(self) -> PromptSocket | paramiko.Channel:
        target = self.target
        if self.hop is None:
            limits = self.timeouts
            return dial(
                target.host,
                target.address,
                target.port,
                limits.connect,
                acknowledgement=limits.acknowledgement,
            )
        try:
            return self.hop.open_channel(
                "direct-tcpip",
                (target.address, target.port),
                ("127.0.0.1", 0),
                timeout=self.timeouts.channel,
            )
        except (paramiko.SSHException, EOFError, OSError) as error:
            through = target.jump.host if target.jump else ""
            raise HostError(
                Kind.UNREACHABLE,
                f"{target.host} ({target.address}, port {target.port}) cannot be reached "
                f"through {through}: {error}",
                f"does {through} reach it, and does its sshd allow forwarding (AllowTcpForwarding)?",
            ) from error


class _Client(paramiko.Transport):
    """Keeps what a host offers, for the error about one that is too old."""

    _offers: dict[str, list[str]] = {}  # noqa: RUF012  (replaced, never changed)

    def _really_parse_kex_init(self, *args: Any, **options: Any) -> dict[str, Any]:
        self._offers = super()._really_parse_kex_init(*args, **options)  # type: ignore[misc]
        return self._offers

    def offered(self, complaint: str) -> str:
        """The algorithms of the kind that paramiko's ``complaint`` is about, or the complaint."""
        kinds = (key for word, key in _OFFERS.items() if word in complaint)
        names = ", ".join(self._offers.get(next(kinds, ""), ()))[:_MOST_QUOTED]
        return names.encode("unicode_escape").decode() or complaint


def _too_old(target: Target, offered: str) -> HostError:
    return HostError(
        Kind.UNREACHABLE,
        f"{target.host} ({target.address}, port {target.port}) offers only {offered}: no longer safe",
        "update its sshd (OpenSSH 6.5 or newer), or reach it through a newer host with ProxyJump",
    )


def _exchange_keys(
    route: PromptSocket | paramiko.Channel, target: Target, timeouts: Timeouts
) -> paramiko.Transport:
    client = _Client(route, disabled_algorithms=_WEAK)
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
                raise _too_old(target, client.offered(str(error))) from error
            raise _handshake_error(error, target, late=late, greeted=greeted) from error
        raise
    return client


def _handshake_error(error: Exception, target: Target, *, late: bool, greeted: bool) -> HostError:
    """``late``: a time limit ended it; ``greeted``: the host has sent its SSH banner."""
    where = f"{target.host} ({target.address}, port {target.port})"
    if late and greeted:
        return HostError(
            Kind.UNREACHABLE,
            f"{where} answers, but does not finish the SSH handshake",
            "the host may be overloaded or hung",
        )
    if late:
        return HostError(
            Kind.UNREACHABLE,
            f"{where} accepts the connection but sends no SSH banner",
            "the host may be overloaded or hung, or this is not an SSH port",
        )
    if isinstance(error, EOFError | OSError) or "banner" in str(error):
        when = "during the SSH handshake" if greeted else "before its SSH banner"
        return _DroppedError(
            Kind.UNREACHABLE,
            f"{where} closed the connection {when}",
            "its sshd may have too many pending logins (MaxStartups), or this is not an SSH port",
        )
    return HostError(Kind.UNREACHABLE, f"{where}: the SSH handshake failed: {str(error)[:_MOST_QUOTED]}")


def _preferred(supported: tuple[str, ...], pinned: tuple[str, ...]) -> tuple[str, ...]:
    """The key types to ask for, pinned ones first: a host with several keys then shows the pinned one."""
    types = [key.split(maxsplit=1)[0] for key in pinned]
    wanted = [name for kind in types for name in _SIGNATURES.get(kind, (kind,)) if name in supported]
    return tuple(dict.fromkeys([*wanted, *supported]))


def _public(key: paramiko.PKey) -> str:
    return f"{key.get_name()} {key.get_base64()}"


def _compare(target: Target, shown: str) -> None:
    """Raises ``HostError`` if a host's key is not one of the pinned ones, or is revoked."""
    kind = shown.split(maxsplit=1)[0]
    if shown in target.revoked:
        raise HostError(
            Kind.HOST_KEY,
            f"{target.host} ({target.address}) shows a revoked host key: {kind} {fingerprint(shown)}",
            "its line in the known_hosts file beside the spec begins with @revoked; "
            "make new keys on the host (remove /etc/ssh/ssh_host_*, run `ssh-keygen -A`)",
        )
    if shown in target.keys:
        return
    if not target.keys:
        raise HostError(
            Kind.HOST_KEY,
            f"{target.host} ({target.address}) has no pinned key; it shows {kind} {fingerprint(shown)}",
            "`swarmctl trust SPEC` shows the keys of new hosts and pins them",
        )
    pinned = ", ".join(f"{key.split()[0]} {fingerprint(key)}" for key in target.keys)
    raise HostError(
        Kind.HOST_KEY,
        f"{target.host} ({target.address}) shows another host key than the pinned one: "
        f"pinned {pinned}, shown {kind} {fingerprint(shown)}",
        f"re-flashed? `swarmctl trust SPEC --host {target.host} --replace`; if not, this is another machine",
    )


def _accepted(client: paramiko.Transport, target: Target, identity: Identity) -> bool:
    """True if the host accepts this key."""
    try:
        return not client.auth_publickey(target.user, identity.key)
    except paramiko.BadAuthenticationType as error:
        if "publickey" in error.allowed_types:  # the key was accepted; the host requires a second factor
            return False
        raise HostError(
            Kind.AUTH,
            f"{target.host} accepts no public keys from {target.user}, only {', '.join(error.allowed_types)}",
            "allow PubkeyAuthentication in its sshd; swarmctl sends no passwords",
        ) from error
    except paramiko.AuthenticationException as error:
        if str(error) == _NO_REPLY:
            raise _silent(target, f"{client.auth_timeout:g} s passed") from error
        if client.is_active():
            return False
        raise HostError(
            Kind.AUTH,
            f"{target.host} closed the connection while {target.user} logged in",
            "too many keys in ssh-agent? name the right one with IdentityFile in ~/.ssh/config",
        ) from error
    except (paramiko.SSHException, EOFError, OSError) as error:
        raise _silent(target, str(error)) from error


def _silent(target: Target, reason: str) -> HostError:
    return HostError(
        Kind.UNREACHABLE,
        f"{target.host} stopped answering while {target.user} logged in: {reason}",
        "the host may be overloaded or hung; run the same command again",
    )
