"""TCP connections over Wi-Fi: bounded connecting, no delayed acknowledgements, dead peers detected."""

from __future__ import annotations

import socket

from swarmctl.remote.transport import HostError, Kind

_QUICKACK = getattr(socket, "TCP_QUICKACK", None)


class PromptSocket(socket.socket):
    """A TCP socket that acknowledges at once.

    The kernel falls back to delayed acknowledgements after a while, and those cost 40 ms where SSH's small
    packets meet Nagle's algorithm on the other side; hence the option is set anew before each read.
    """

    def recv(self, bufsize: int, flags: int = 0, /) -> bytes:
        """Receives as ``socket.recv`` does, and acknowledges at once."""
        if _QUICKACK is not None:
            self.setsockopt(socket.IPPROTO_TCP, _QUICKACK, 1)
        return super().recv(bufsize, flags)


def dial(host: str, address: str, port: int, timeout: float, *, acknowledgement: float) -> PromptSocket:
    """Returns a connection to ``address``, which ends ``acknowledgement`` seconds after the peer's last.

    Raises ``HostError`` with the reason why ``host`` is unreachable.
    """
    where = f"{host} ({address}, port {port})"
    try:
        plain = socket.create_connection((address, port), timeout)
    except socket.gaierror as error:
        raise HostError(
            Kind.UNREACHABLE,
            f"{host}: no address is known for the name {address}",
            "check `address` of this host in the spec, or name resolution on this machine",
        ) from error
    except TimeoutError as error:
        raise HostError(
            Kind.UNREACHABLE,
            f"{where} did not answer within {timeout:g} s",
            "is the host switched on and in the same network?",
        ) from error
    except ConnectionRefusedError as error:
        raise HostError(
            Kind.UNREACHABLE,
            f"{where} is up, but nothing listens for SSH there",
            "is sshd installed and running on the host, and is this its port?",
        ) from error
    except OSError as error:
        reason = error.strerror or str(error)
        raise HostError(
            Kind.UNREACHABLE,
            f"{where} cannot be reached: {reason[:1].lower()}{reason[1:]}",
            "is the host switched on and in the same network?",
        ) from error
    connection = PromptSocket(plain.family, plain.type, plain.proto, fileno=plain.detach())
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for option, value in _dead_peer_options(acknowledgement).items():
        if hasattr(socket, option):
            connection.setsockopt(socket.IPPROTO_TCP, getattr(socket, option), value)
    return connection


def _dead_peer_options(seconds: float) -> dict[str, int]:
    """Of tcp(7); an idle connection is probed three times in that time.

    Set where the operator's system has them (Linux); elsewhere the deadlines of every call still hold.
    """
    probe = max(1, round(seconds / 3))
    return {
        "TCP_USER_TIMEOUT": round(1000 * seconds),  # ms
        "TCP_KEEPIDLE": probe,
        "TCP_KEEPINTVL": probe,
        "TCP_KEEPCNT": 3,
    }
