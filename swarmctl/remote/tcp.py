"""TCP connections over Wi-Fi: bounded connecting, no delayed acknowledgements, dead peers detected."""

from __future__ import annotations

import socket
import struct
from contextlib import suppress

from swarmctl.remote.ssh_errors import no_answer, no_way, nothing_listens, unknown_name
from swarmctl.remote.transport import Target

_QUICKACK = getattr(socket, "TCP_QUICKACK", None)
_INFO = getattr(socket, "TCP_INFO", -1)
_SENT_AGAIN, _SENT = 100, 136  # where struct tcp_info of linux/tcp.h has tcpi_total_retrans and tcpi_segs_out


class PromptSocket(socket.socket):
    """A TCP socket that acknowledges at once.

    The kernel falls back to delayed acknowledgements after a while, and those cost 40 ms where SSH's small
    packets meet Nagle's algorithm on the other side; hence the option is set anew before each read.
    """

    _sent_again = (0, 0)

    def recv(self, bufsize: int, flags: int = 0, /) -> bytes:
        """Receives as ``socket.recv`` does, and acknowledges at once."""
        if _QUICKACK is not None:
            self.setsockopt(socket.IPPROTO_TCP, _QUICKACK, 1)
        return super().recv(bufsize, flags)

    def close(self) -> None:
        """Closes the connection."""
        self.sent_again()
        super().close()

    def sent_again(self) -> tuple[int, int]:
        """Returns how many segments were sent again, and how many in all; zeros where that is unknown."""
        with suppress(OSError, struct.error):  # it is closed, or the system is not Linux
            info = self.getsockopt(socket.IPPROTO_TCP, _INFO, _SENT + 4)
            again, sent = (struct.unpack_from("=I", info, at)[0] for at in (_SENT_AGAIN, _SENT))
            self._sent_again = again, sent
        return self._sent_again


def dial(target: Target, timeout: float, *, acknowledgement: float) -> PromptSocket:
    """Returns a connection to ``target``, which ends ``acknowledgement`` seconds after the peer's last.

    Raises ``HostError`` with the reason why it is unreachable.
    """
    try:
        plain = socket.create_connection((target.address, target.port), timeout)
    except socket.gaierror as error:
        raise unknown_name(target) from error
    except TimeoutError as error:
        raise no_answer(target, timeout) from error
    except ConnectionRefusedError as error:
        raise nothing_listens(target) from error
    except OSError as error:
        raise no_way(target, error.strerror or str(error)) from error
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
