"""A WireGuard interface: of the kernel, else of `wireguard-go`. Sources: wg(8), ip(8)."""

from __future__ import annotations

import os
import re
import shutil
import socket
import subprocess
import time
from contextlib import suppress
from pathlib import Path

FRESH = 180  # s: a key is good for so long after a handshake (REJECT_AFTER_TIME of WireGuard)
_TIMEOUT = 5.0  # s for a command, for wireguard-go to make the interface, and for it to end
_LOOK_EVERY = 0.05  # s
_LONGEST_MESSAGE = 500
_PACKAGES = {"ip": "iproute2", "wg": "wireguard-tools"}
_WIREGUARD_GO = {"LOG_LEVEL": "error", "WG_PROCESS_FOREGROUND": "1"}
#: 32 bytes in base64. wg would print a text that is no key, into the log.
_KEY = re.compile(rb"[A-Za-z0-9+/]{42}[AEIMQUYcgkosw048]=\s*")


class WireguardError(Exception):
    """A command failed; the message is its own, or names what is missing."""


class Interface:
    """One interface, with the private key in a file."""

    def __init__(self, name: str, key: Path) -> None:
        self.name = name
        self._key = key
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

    def bring_up(self, address: str, mtu: int, peers: bytes) -> None:
        """Configures a new interface: first its keys, then its address. Raises ``WireguardError``."""
        self._configure("setconf", peers)
        _run("ip", "address", "replace", address, "dev", self.name)
        _run("ip", "link", "set", "dev", self.name, "mtu", str(mtu), "up")

    def use(self, peers: bytes) -> None:
        """Changes the peers; those that stay are not interrupted. Raises ``WireguardError``."""
        self._configure("syncconf", peers)

    def _configure(self, command: str, peers: bytes) -> None:
        """Gives wg the peers and the key, without which it would remove the key of the interface."""
        try:
            key = self._key.read_bytes()
        except OSError as error:
            raise WireguardError(f"{self._key}: {error.strerror}") from error
        if not _KEY.fullmatch(key):
            raise WireguardError(f"{self._key} has no key of WireGuard")
        text = b"[Interface]\nPrivateKey = " + key.strip() + b"\n" + peers
        _run("wg", command, self.name, "/dev/stdin", given=text)

    def handshakes(self) -> tuple[int, int]:
        """Returns with how many peers there was a handshake lately, and how many there are."""
        lines = _run("wg", "show", self.name, "latest-handshakes").decode().splitlines()
        times = [int(line.split()[1]) for line in lines]
        return sum(one > time.time() - FRESH for one in times), len(times)

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
