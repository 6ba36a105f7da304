"""The operator's private keys: loaded once and shared by all hosts; ssh-agent only when none is named."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Lock

from cryptography.exceptions import UnsupportedAlgorithm

from swarmctl.remote.lean_paramiko import PublicBlob, paramiko
from swarmctl.remote.ssh_errors import LockedKeyError, locked_key, missing_key, unusable_key
from swarmctl.remote.transport import HostError

DEFAULT_FILES = ("id_ed25519", "id_ecdsa", "id_rsa")
SECURITY_KEY_FILES = ("id_ed25519_sk", "id_ecdsa_sk")


@dataclass(frozen=True)
class Identity:
    """One private key, and its name for messages."""

    name: str
    key: paramiko.PKey


class Keyring:
    """Loads private keys on first use. Safe to share between threads.

    ``home`` is the folder of OpenSSH's default keys, tried when neither the target nor ssh-agent has one.
    """

    def __init__(self, home: Path | None = None, *, use_agent: bool = True) -> None:
        self.home = home if home is not None else Path.home() / ".ssh"
        self.use_agent = use_agent
        self._loaded: dict[Path, Identity] = {}
        self._lock = Lock()

    def identities(self, paths: Sequence[Path]) -> tuple[Identity, ...]:
        """Returns the keys to offer: the files at ``paths``, else those of ssh-agent, else the defaults."""
        with self._lock:
            if not paths and (found := tuple(self._agent())):
                return found
            return tuple(self._file(path) for path in self._files(paths))

    def locked(self, paths: Sequence[Path]) -> tuple[Path, ...]:
        """Returns those of the files that have a passphrase, and whose keys ssh-agent does not hold."""
        with self._lock:
            if not paths and any(self._agent()):
                return ()
            return tuple(
                path for path in self._files(paths) if path not in self._loaded and self._is_locked(path)
            )

    def unlock(self, path: Path, passphrase: str) -> bool:
        """Returns True if this is the passphrase of the key; the key is loaded then."""
        with self._lock:
            try:
                key = paramiko.PKey.from_path(path, passphrase.encode())  # type: ignore[arg-type]  # takes bytes only
            except (OSError, ValueError, TypeError, paramiko.SSHException, UnsupportedAlgorithm):
                return False
            self._loaded[path] = Identity(str(path), key)
            return True

    def beyond_paramiko(self, paths: Sequence[Path]) -> str:
        """Which of the keys only ``ssh`` can use, a certificate or a security key; empty if none."""
        defaults = (self.home / name for name in (*SECURITY_KEY_FILES, *DEFAULT_FILES))
        for path in map(Path.expanduser, paths or defaults):
            if _is_file(certificate := path.with_name(f"{path.name}-cert.pub")):
                return f"{certificate} is a certificate"
            if _on_security_key(path):
                return f"the key {path} is on a security key"
        with self._lock:
            names = [] if paths else [one.key.get_name() for one in self._agent()]
        beyond = next((name for name in names if name.startswith("sk-") or "-cert-" in name), "")
        return f"ssh-agent has a key of type {beyond}" if beyond else ""

    def _files(self, paths: Sequence[Path]) -> Iterator[Path]:
        if paths:
            return (path.expanduser() for path in paths)
        return (path for name in DEFAULT_FILES if (path := self.home / name).is_file())

    def _is_locked(self, path: Path) -> bool:
        try:
            self._file(path)
        except HostError as error:
            return isinstance(error, LockedKeyError)
        return False

    def _agent(self) -> Iterator[Identity]:
        if not self.use_agent:
            return
        for key in paramiko.Agent().get_keys():
            yield Identity(f"{key.comment or key.get_name()} (ssh-agent)", key)

    def _file(self, path: Path) -> Identity:
        if path not in self._loaded:
            self._loaded[path] = self._load(path)
        return self._loaded[path]

    def _load(self, path: Path) -> Identity:
        try:
            return Identity(str(path), paramiko.PKey.from_path(path))
        except (paramiko.PasswordRequiredException, TypeError) as error:
            # OpenSSH does the same: an encrypted key is fine when ssh-agent holds it opened.
            if held := self._held_by_agent(path):
                return held
            raise locked_key(path) from error
        except FileNotFoundError as error:
            raise missing_key(path) from error
        except (OSError, ValueError, paramiko.SSHException, UnsupportedAlgorithm) as error:
            raise unusable_key(path, error) from error

    def _held_by_agent(self, path: Path) -> Identity | None:
        with suppress(OSError, ValueError):  # not a public key, or no UTF-8
            wanted = PublicBlob.from_file(str(path.with_name(f"{path.name}.pub"))).key_blob
            return next((one for one in self._agent() if one.key.asbytes() == wanted), None)
        return None


def _is_file(path: Path) -> bool:
    with suppress(OSError):
        return path.is_file()
    return False


def _on_security_key(path: Path) -> bool:
    with suppress(OSError, ValueError):
        return path.with_name(f"{path.name}.pub").read_text().startswith("sk-")
    return False
