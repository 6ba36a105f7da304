"""Pinned host keys: an OpenSSH known_hosts file beside the spec. Opens no connection.

``ssh -o UserKnownHostsFile=swarm.known_hosts robot@192.168.77.11`` reads the same file.
"""

from __future__ import annotations

import base64
import hmac
import os
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import yaml

from swarmctl.remote.host_keys import BadKeyError, parse_key
from swarmctl.remote.openssh_files import OpenSshFileError, matches, read_text

_HEADER = "# SSH host keys of this swarm, pinned by `swarmctl trust`. Keep this file beside the spec, in git."
_REVOKED = "@revoked"
_MARKERS = ("", "@cert-authority", _REVOKED)


@dataclass(frozen=True)
class Line:
    """One line of the file. Comments and empty lines have no ``names``."""

    text: str
    names: tuple[str, ...] = ()
    key: str = ""  # "ssh-ed25519 AAAA..."
    marker: str = ""

    def matches(self, names: Sequence[str]) -> bool:
        """True if the line is about a host with one of these lower-case names."""
        return matches(self.names, names) or any(_hashes(one, name) for one in self.names for name in names)

    def without(self, names: Sequence[str]) -> Line | None:
        """The line without these names, hashed ones included; None if no name is left. Wildcards stay."""
        kept = tuple(
            one
            for one in self.names
            if one.lower() not in names and not any(_hashes(one, name) for name in names)
        )
        if kept == self.names:
            return self
        return _line(",".join(kept), *self.text.split()[1:]) if kept else None


@dataclass(frozen=True)
class KnownHosts:
    """The pinned keys. Any one of a host's keys is accepted; a revoked one never is.

    A host is looked up by its name in the spec, so that a key stays pinned when the address changes. If
    no line has the name, its address is looked up; ssh writes it ``[address]:port`` if the port is not 22.
    """

    lines: tuple[Line, ...] = ()

    def keys(self, host: str, address: str, port: int) -> tuple[str, ...]:
        """The pinned keys of a host, ``"ssh-ed25519 AAAA..."`` each; empty if it is not known."""
        pinned = [line for line in self.lines if line.names and not line.marker]
        by_name = [line.key for line in pinned if line.matches(_own_names(host, port))]
        return tuple(by_name or [line.key for line in pinned if line.matches((ssh_name(address, port),))])

    def revoked(self, host: str, address: str, port: int) -> tuple[str, ...]:
        """The keys that must not be accepted from this host."""
        names = (*_own_names(host, port), ssh_name(address, port))
        return tuple(line.key for line in self.lines if line.marker == _REVOKED and line.matches(names))

    def pinned(self, host: str, address: str, port: int, keys: Sequence[str]) -> KnownHosts:
        """The same file with ``keys`` as the only ones of a host; other hosts and all comments stay."""
        names = (*_own_names(host, port), ssh_name(address, port))
        kept = [line if line.marker else line.without(names) for line in self.lines]
        changed = [at for at, line in enumerate(kept) if line is not self.lines[at]]
        at = changed[0] if changed else len(kept)
        written = ",".join(dict.fromkeys((host.lower(), ssh_name(address, port))))
        fresh = [_line(written, key) for key in keys]
        return KnownHosts(tuple(line for line in (*kept[:at], *fresh, *kept[at:]) if line is not None))

    def dump(self) -> str:
        """The text of the file."""
        return "".join(f"{line.text}\n" for line in self.lines or (Line(_HEADER),))


def ssh_name(address: str, port: int) -> str:
    """How known_hosts names an SSH server: the address, with the port if that is not 22."""
    return (address if port == 22 else f"[{address}]:{port}").lower()


def _own_names(host: str, port: int) -> tuple[str, str]:
    return host.lower(), ssh_name(host, port)


def path_beside(spec: Path) -> Path:
    """The file with the pinned keys of ``spec``: ``swarm.known_hosts`` beside ``swarm.yaml``."""
    return spec.with_name(f"{spec.stem}.known_hosts")


def old_path_beside(spec: Path) -> Path:
    """The YAML file in which earlier versions kept the keys."""
    return spec.with_name(f"{spec.stem}.lock.yaml")


def read(path: Path) -> KnownHosts:
    """The pinned keys in the file at ``path``; none if it does not exist. Raises ``OpenSshFileError``."""
    return parse(read_text(path), str(path)) if os.path.lexists(path) else KnownHosts((Line(_HEADER),))


def parse(text: str, name: str) -> KnownHosts:
    """Read the text of a known_hosts file strictly; ``name`` stands for the file in errors."""
    lines = text.removesuffix("\n").split("\n") if text else [_HEADER]
    return KnownHosts(tuple(_parse_line(line, f"{name}:{at}") for at, line in enumerate(lines, 1)))


def _parse_line(text: str, place: str) -> Line:
    words = text.split()
    if not words or words[0].startswith("#"):
        return Line(text)
    marker = words.pop(0) if words[0].startswith("@") else ""
    if marker not in _MARKERS:
        raise OpenSshFileError(
            f"{place}: the marker {marker} is not known, only {' and '.join(_MARKERS[1:])}"
        )
    if len(words) < 3:
        raise OpenSshFileError(f"{place}: a line needs host names, a key type and a key")
    try:
        parse_key(" ".join(words[1:3]))
    except BadKeyError as error:
        raise OpenSshFileError(f"{place}: not a public key: {error}") from error
    return Line(text, tuple(words[0].split(",")), " ".join(words[1:3]), marker)


def _line(names: str, *key_and_comment: str) -> Line:
    text = " ".join((names, *key_and_comment))
    return Line(text, tuple(names.split(",")), " ".join(text.split()[1:3]))


def _hashes(hashed: str, name: str) -> bool:
    """True if ``hashed`` (``|1|salt|HMAC-SHA1``, as HashKnownHosts writes it) stands for ``name``."""
    match hashed.split("|"):
        case ["", "1", salt, digest]:
            try:
                made = hmac.digest(base64.b64decode(salt), name.encode(), "sha1")
            except ValueError:
                return False
            return base64.b64encode(made).decode() == digest
    return False


def parse_old_file(text: str, name: str) -> Mapping[str, tuple[str, ...]]:
    """The keys by host name in a ``NAME.lock.yaml`` of earlier versions. Raises ``OpenSshFileError``."""
    try:
        hosts = yaml.safe_load(text)["hosts"]
        found = {str(host): tuple(" ".join(key.split()[:2]) for key in hosts[host]["keys"]) for host in hosts}
        for key in (key for keys in found.values() for key in keys):
            parse_key(key)
    except (yaml.YAMLError, RecursionError, ValueError, TypeError, KeyError, AttributeError) as error:
        raise OpenSshFileError(f"{name}: not a file of host keys: {' '.join(str(error).split())}") from error
    return found


def write(path: Path, known: KnownHosts) -> None:
    """Replace the file at ``path``; a reader, or a crash, finds the old or the new text, never a part."""
    descriptor, draft = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    try:
        with os.fdopen(descriptor, "w", encoding="utf-8", errors="surrogateescape") as file:
            file.write(known.dump())
            file.flush()
            os.fsync(file.fileno())
        Path(draft).chmod(0o644)
        Path(draft).replace(path)
    except BaseException:
        Path(draft).unlink(missing_ok=True)
        raise
