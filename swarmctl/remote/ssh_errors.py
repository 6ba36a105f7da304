"""What can go wrong while logging in to a host, as both SSH transports report it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from swarmctl.remote.known_hosts import fingerprint
from swarmctl.remote.transport import HostError, Kind, Target

_MOST_QUOTED = 200  # characters of what a host sends
_UNSAFE = ("sha1", "md5", "-cbc", "ssh-rsa", "ssh-dss", "arcfour", "rijndael")  # in names of algorithms
_OVERLOADED = "the host may be overloaded or hung"
_AGAIN = "run the same command again"
_FEW, _LOSSY = 3, 0.1  # packets sent again, and the share of all, that a good link does not reach
_POWER = "is the host switched on and in the same network?"


@dataclass(unsafe_hash=True)
class DroppedError(HostError):
    """Closed before the SSH banner, as sshd does beyond its ``MaxStartups``."""


@dataclass(unsafe_hash=True)
class NoCommonAlgorithmError(HostError):
    """Host and operator have no algorithm in common."""


@dataclass(unsafe_hash=True)
class LockedKeyError(HostError):
    """A private key has a passphrase."""


def place(target: Target) -> str:
    """How errors name where a host is reached."""
    return f"{target.host} ({target.address}, port {target.port})"


def quoted(text: str) -> str:
    """What a host sent, short, on one line and harmless on a terminal."""
    return text[:_MOST_QUOTED].encode("unicode_escape").decode()


def unknown_name(target: Target) -> HostError:
    """The name of the host has no address."""
    return HostError(
        Kind.UNREACHABLE,
        f"{target.host}: cannot resolve {target.address}",
        "check `address` of this host in the spec, or name resolution on this machine",
    )


def no_answer(target: Target, seconds: float) -> HostError:
    """Nothing came back from its address."""
    return HostError(Kind.UNREACHABLE, f"{place(target)} did not answer within {seconds:.3g} s", _POWER)


def nothing_listens(target: Target) -> HostError:
    """Its port is closed."""
    return HostError(
        Kind.UNREACHABLE,
        f"{place(target)} is up, but nothing listens for SSH there",
        "is sshd installed and running on the host, and is this its port?",
    )


def no_way(target: Target, reason: str) -> HostError:
    """The network reports that it cannot be reached."""
    reason = f"{reason[:1].lower()}{reason[1:]}"
    return HostError(Kind.UNREACHABLE, f"{place(target)} cannot be reached: {reason}", _POWER)


def no_way_through_hop(target: Target, reason: str) -> HostError:
    """Its jump host does not reach it."""
    through = target.jump.host if target.jump else ""
    return HostError(
        Kind.UNREACHABLE,
        f"{place(target)} cannot be reached through {through}: {reason}",
        f"does {through} reach it, and does its sshd allow forwarding (AllowTcpForwarding)?",
    )


def no_banner(target: Target) -> HostError:
    """It accepts the connection, and then is silent."""
    return HostError(
        Kind.UNREACHABLE,
        f"{place(target)} accepts the connection but sends no SSH banner",
        f"{_OVERLOADED}, or this is not an SSH port",
    )


def stalled_handshake(target: Target) -> HostError:
    """It is silent amid the key exchange."""
    return HostError(
        Kind.UNREACHABLE, f"{place(target)} answers, but does not finish the SSH handshake", _OVERLOADED
    )


def dropped(target: Target, *, greeted: bool) -> DroppedError:
    """It closed the connection before the login; ``greeted``: after its SSH banner."""
    when = "during the SSH handshake" if greeted else "before its SSH banner"
    return DroppedError(
        Kind.UNREACHABLE,
        f"{place(target)} closed the connection {when}",
        "its sshd may have too many pending logins (MaxStartups), or this is not an SSH port",
    )


def failed_handshake(target: Target, reason: str) -> HostError:
    """Whatever else ends the key exchange."""
    return HostError(Kind.UNREACHABLE, f"{place(target)}: the SSH handshake failed: {reason[:_MOST_QUOTED]}")


def no_common_algorithm(target: Target, offered: str, *, program: bool) -> NoCommonAlgorithmError:
    """``offered``: its algorithms of the kind of which none is acceptable, separated by commas.

    ``program``: OpenSSH has none of them either, as it is configured.
    """
    names = [name.strip() for name in offered.split(",")]
    unsafe = all(any(part in name for part in _UNSAFE) for name in names)
    why = "no longer safe" if unsafe else "OpenSSH here has none of them" if program else "paramiko has none"
    update = "update its sshd (OpenSSH 6.5 or newer), or reach it through a newer host with ProxyJump"
    return NoCommonAlgorithmError(
        Kind.UNREACHABLE,
        f"{place(target)} offers only {quoted(', '.join(names))}: {why}",
        f"{update}; what its block in ~/.ssh/config allows, such as `HostKeyAlgorithms +ssh-rsa`, is used"
        if unsafe
        else update,
    )


def wrong_host_key(target: Target, shown: str, *, revoked: bool) -> HostError:
    """The host shows a key that is not pinned, or is revoked; ``shown``: its type and fingerprint."""
    if revoked:
        return HostError(
            Kind.HOST_KEY,
            f"{target.host} ({target.address}) shows a revoked host key: {shown}",
            "its line in the known_hosts file beside the spec begins with @revoked; "
            "make new keys on the host (remove /etc/ssh/ssh_host_*, run `ssh-keygen -A`)",
        )
    if not target.keys:
        return HostError(
            Kind.HOST_KEY,
            f"{target.host} ({target.address}) has no pinned key; it shows {shown}",
            "`swarmctl trust SPEC` shows the keys of new hosts and pins them",
        )
    pinned = ", ".join(with_fingerprint(key) for key in target.keys)
    return HostError(
        Kind.HOST_KEY,
        f"{target.host} ({target.address}) shows another host key than the pinned one: "
        f"pinned {pinned}, shown {shown}",
        f"re-flashed? `swarmctl trust SPEC --host {target.host} --replace`; if not, this is another machine",
    )


def with_fingerprint(key: str) -> str:
    """The type and fingerprint of a public key."""
    return f"{key.split(maxsplit=1)[0]} {fingerprint(key)}"


def no_private_key(target: Target) -> HostError:
    """The operator has none."""
    return HostError(
        Kind.AUTH,
        f"there is no private key to log in to {target.host} with",
        "create one with `ssh-keygen -t ed25519`, copy it to the host with "
        f"`ssh-copy-id {target.user}@{target.address}`",
    )


def locked_key(path: object) -> LockedKeyError:
    """A private key has a passphrase that is not known."""
    return LockedKeyError(
        Kind.AUTH, f"the private key {path} has a passphrase", f"add it to ssh-agent with `ssh-add {path}`"
    )


def locked_token(provider: str) -> HostError:
    """A PKCS#11 token wants its PIN; ``provider``: its library."""
    return HostError(
        Kind.AUTH,
        f"the token of {provider or 'PKCS11Provider'} wants its PIN",
        f"add it to ssh-agent with `ssh-add -s {provider or 'LIBRARY'}`",
    )


def no_ticket(target: Target, reason: str) -> HostError:
    """Kerberos has no ticket for the login."""
    return HostError(
        Kind.AUTH, f"there is no Kerberos ticket to log in to {target.host}: {reason}", "get one with `kinit`"
    )


def missing_key(path: object) -> HostError:
    """A private key that is named is not there."""
    return HostError(
        Kind.AUTH, f"the private key {path} does not exist", "create one with `ssh-keygen -t ed25519`"
    )


def unusable_key(path: object, reason: object) -> HostError:
    """A private key cannot be read, or is none."""
    return HostError(
        Kind.AUTH,
        f"the private key {path} cannot be used: {reason}",
        f"try `ssh-keygen -y -f {path}`, which must print its public half",
    )


def rejected(target: Target, tried: Sequence[str]) -> HostError:
    """It accepts none of these keys."""
    return HostError(
        Kind.AUTH,
        f"{target.host} rejected the login of {target.user}; tried {', '.join(tried)}",
        f"`ssh-copy-id -i KEY -p {target.port} {target.user}@{target.address}` authorises a key",
    )


def no_public_keys(target: Target, methods: Sequence[str]) -> HostError:
    """It wants something else than a key."""
    return HostError(
        Kind.AUTH,
        f"{target.host} accepts no public keys from {target.user}, only {', '.join(methods)}",
        "allow PubkeyAuthentication in its sshd; swarmctl sends no passwords",
    )


def closed_login(target: Target) -> HostError:
    """It closed the connection amid the login."""
    return HostError(
        Kind.AUTH,
        f"{target.host} closed the connection while {target.user} logged in",
        "too many keys in ssh-agent? name the right one with IdentityFile in ~/.ssh/config",
    )


def silent_login(target: Target, reason: str) -> HostError:
    """It is silent amid the login."""
    return HostError(
        Kind.UNREACHABLE,
        f"{target.host} stopped answering while {target.user} logged in: {reason}",
        f"{_OVERLOADED}; {_AGAIN}",
    )


def lost(host: str, reason: str = "") -> HostError:
    """The connection died while a command ran."""
    known = f" ({reason})" if reason else ""
    return HostError(Kind.LOST, f"{host}: the connection was lost{known}", _AGAIN)


def unfinished(host: str, seconds: float) -> HostError:
    """A command was not done in its time."""
    return HostError(Kind.LOST, f"{host} did not finish within {seconds:g} s", f"{_OVERLOADED}; {_AGAIN}")


def with_losses(error: HostError, sent_again: tuple[int, int]) -> HostError:
    """The error with how many packets to the host were lost, if these may be why its connection was lost."""
    again, sent = sent_again
    if error.kind is not Kind.LOST or again < _FEW or again < _LOSSY * sent:
        return error
    text = f"{error.message}; {again} of {sent} packets to it had to be sent again"
    return HostError(Kind.LOST, text, "its link loses packets: improve the signal, or use another channel")


def flooded(host: str, limit: int) -> HostError:
    """A command printed more than it may."""
    return HostError(
        Kind.PROTOCOL,
        f"{host} sent more than {limit} bytes where a short answer was expected",
        "check what the login shell of this account prints, then try again",
    )
