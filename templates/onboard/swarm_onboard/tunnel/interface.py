"""A WireGuard interface: of the kernel, else of `wireguard-go`. Sources: wg(8), ip(8).

By netlink, not below /proc/sys, which units and containers may not write.
"""

from __future__ import annotations

import os
import shutil
import socket
import struct
import subprocess
import time
from contextlib import suppress
from pathlib import Path
from typing import Mapping

from swarm_onboard.tunnel.keys import is_key

_NEW_LINK, _REQUEST, _ACK, _ERROR = 16, 0x1, 0x4, 2
_AF_SPEC, _INET_CONF, _FORWARDING, _NESTED = 26, 1, 1, 0x8000  # the third is IPV4_DEVCONF_FORWARDING
_HEADER, _LINK = struct.Struct("=IHHII"), struct.Struct("=BxHiII")
_NETLINK_TIMEOUT = 5.0  # s


def forward_from(interface: str) -> None:
    """Forwards what comes out of the interface, over IPv4. Raises ``OSError``."""
    value = _attribute(_FORWARDING, struct.pack("=I", 1))
    spec = _nested(_AF_SPEC, _nested(socket.AF_INET, _nested(_INET_CONF, value)))
    body = _LINK.pack(socket.AF_UNSPEC, 0, socket.if_nametoindex(interface), 0, 0) + spec
    header = _HEADER.pack(_HEADER.size + len(body), _NEW_LINK, _REQUEST | _ACK, 1, 0)
    with socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, socket.NETLINK_ROUTE) as link:
        link.settimeout(_NETLINK_TIMEOUT)
        link.send(header + body)
        answer = link.recv(4096)
    _, kind, *_ = _HEADER.unpack_from(answer)
    (error,) = struct.unpack_from("=i", answer, _HEADER.size)
    if kind != _ERROR or error:
        raise OSError(-error, f"{interface} does not forward: {os.strerror(-error)}")


def _nested(kind: int, content: bytes) -> bytes:
    return _attribute(kind | _NESTED, content)


def _attribute(kind: int, content: bytes) -> bytes:
    """A netlink attribute, whose content is a multiple of 4 bytes here."""
    return struct.pack("=HH", 4 + len(content), kind) + content


FRESH = 180  # s: a key is good for so long after a handshake (REJECT_AFTER_TIME of WireGuard)
_TIMEOUT = 5.0  # s for a command, for wireguard-go to make the interface, and for it to end
_LOOK_EVERY = 0.05  # s
_LONGEST_MESSAGE = 500
_PACKAGES = {"ip": "iproute2", "wg": "wireguard-tools"}
_WIREGUARD_GO = {"LOG_LEVEL": "error", "WG_PROCESS_FOREGROUND": "1"}


class WireguardError(Exception):
    """A command failed; the message is its own, or names what is missing."""


class Interface:
    """One interface, with the private key in a file."""

    def __init__(self, name: str, key: Path) -> None:
        self.name = name
        self._key = key
        self._used = b""  # the private key that it has
        self._process: subprocess.Popen[bytes] | None = None

    def make(self) -> None:
        """Makes the interface, in place of one that a killed run has left. Raises ``WireguardError``."""
        for program, package in _PACKAGES.items():
            if shutil.which(program) is None:
                raise WireguardError(f"there is no `{program}`: install {package}")
        if self._is_there():
            _run("ip", "link", "delete", "dev", self.name)
        try:
            _run("ip", "link", "add", "dev", self.name, "type", "wireguard")
        except WireguardError as error:
            self._begin_wireguard_go(str(error))

    def _begin_wireguard_go(self, why: str) -> None:
        try:
            self._process = subprocess.Popen(
                ("wireguard-go", self.name),
                env={**os.environ, **_WIREGUARD_GO},
                stdin=subprocess.DEVNULL,
            )
        except OSError as error:
            raise WireguardError(
                f"the kernel makes no WireGuard interface ({why}), and there is no `wireguard-go`: "
                "load the module `wireguard`, or install wireguard-go"
            ) from error
        deadline = time.monotonic() + _TIMEOUT
        while not self._is_configurable():
            if self._process.poll() is not None or time.monotonic() > deadline:
                raise WireguardError(f"wireguard-go made no interface, nor did the kernel ({why})")
            time.sleep(_LOOK_EVERY)

    def _is_configurable(self) -> bool:
        """Whether `wg` reaches the interface: wireguard-go makes it first, and then its socket."""
        if not self._is_there():
            return False
        with suppress(WireguardError):
            _run("wg", "show", self.name, "listen-port")
            return True
        return False

    def _is_there(self) -> bool:
        try:
            socket.if_nametoindex(self.name)
        except OSError:
            return False
        return True

    def trouble(self) -> str:
        """Returns why no packet can pass: the interface, or what runs it, is gone. Empty if all is there."""
        if self._process is not None and self._process.poll() is not None:
            return f"wireguard-go has ended with status {self._process.returncode}"
        return "" if self._is_there() else f"the interface {self.name} is gone"

    def bring_up(self, address: str, mtu: int, peers: str) -> None:
        """Configures a new interface: first its keys, then its address. Raises ``WireguardError``."""
        self.use(peers)
        _run("ip", "address", "replace", address, "dev", self.name)
        _run("ip", "link", "set", "dev", self.name, "mtu", str(mtu), "up")

    def has_another_key(self) -> bool:
        """Whether the file of the private key was replaced since it was used."""
        with suppress(OSError):
            return self._key.read_bytes() != self._used
        return False

    def use(self, peers: str) -> None:
        """Changes the peers, of which those that stay are not interrupted; after a change of the private key
        it calls all of them. Raises ``WireguardError``.

        wg gets the peers with the key, without which it would remove the key of the interface.
        """
        try:
            key = self._key.read_bytes()
        except OSError as error:
            raise WireguardError(f"{self._key}: {error.strerror}") from error
        private = key.decode("latin-1").strip()
        if not is_key(private):
            raise WireguardError(f"{self._key} has no key of WireGuard")
        command = "syncconf" if key == self._used else "setconf"
        given = f"[Interface]\nPrivateKey = {private}\n{peers}"
        _run("wg", command, self.name, "/dev/stdin", given=given.encode())
        self._used = key

    def handshakes(self) -> Mapping[str, int]:
        """Returns the time of the last handshake with each public key, s since 1970, 0 without one.

        Raises ``WireguardError``.
        """
        lines = _run("wg", "show", self.name, "latest-handshakes").decode().splitlines()
        return {key: int(last) for key, last in map(str.split, lines)}

    def remove(self) -> None:
        """Removes the interface, and ends what runs it. Raises ``WireguardError``."""
        if self._process is not None:
            self._process.terminate()
            try:
                self._process.wait(_TIMEOUT)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        elif self._is_there():
            _run("ip", "link", "delete", "dev", self.name)


def _run(*argv: str, given: bytes = b"") -> bytes:
    try:
        done = subprocess.run(argv, input=given, capture_output=True, timeout=_TIMEOUT, check=False)
    except subprocess.TimeoutExpired as error:
        raise WireguardError(f"`{' '.join(argv[:2])}` did not end within {_TIMEOUT:.0f} s") from error
    except OSError as error:
        raise WireguardError(f"{argv[0]}: {error.strerror}") from error
    if done.returncode:
        message = " ".join(done.stderr.decode(errors="replace").split())[:_LONGEST_MESSAGE]
        raise WireguardError(message or f"`{' '.join(argv[:2])}` ended with status {done.returncode}")
    return done.stdout
