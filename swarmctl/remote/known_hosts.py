"""Pinned host keys: an OpenSSH known_hosts file beside the spec. Opens no connection.

``ssh -o UserKnownHostsFile=swarm.known_hosts robot@192.168.77.11`` reads the same file. paramiko.HostKeys
does not fit: it drops comments and wrong lines, and knows neither markers nor patterns.
"""

from __future__ import annotations

import base64
import hashlib
import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from swarmctl.remote.lean_paramiko import PublicBlob, paramiko
from swarmctl.remote.openssh_files import OpenSshFileError, matches, read_text

_HEADER = "# SSH host keys of this swarm, pinned by `swarmctl trust`. Keep this file beside the spec, in git."
REVOKED = "@revoked"
_MARKERS = ("", "@cert-authority", REVOKED)


@dataclass(frozen=True)
class Line:
    """One line of the file. Comments and empty lines have no ``names``."""

    text: str
    names: tuple[str, ...] = ()
    key: str = ""  # "ssh-ed25519 AAAA..."
    marker: str = ""

    def matches(self, names: Sequence[str]) -> bool:
        """True if the line is about a host with one of these lower-case names."""
        return matches(self.names, names) or any(_hashes(one, names) for one in self.names)

    def without(self, names: Sequence[str]) -> Line | None:
        """The line without these names, hashed ones included; None if no name is left. Wildcards stay."""
        kept = [one for one in self.names if one.lower() not in names and not _hashes(one, names)]
        if self.marker or len(kept) == len(self.names):
            return self
        return _parse_line(" ".join((",".join(kept), *self.text.split()[1:]))) if kept else None

    def renamed(self, names: Mapping[str, str]) -> Line:
        """The line with other names for the lower-case ones in ``names``, hashed ones included."""
        new = [
            next((to for one, to in names.items() if own.lower() == one or _hashes(own, (one,))), own)
            for own in self.names
        ]
        if tuple(new) == self.names:
            return self
        words = self.text.split()
        words[1 if self.marker else 0] = ",".join(new)
        return _parse_line(" ".join(words))


@dataclass(frozen=True)
class KnownHosts:
    """The pinned keys. Any one of a host's keys is accepted; a revoked one never is.

    A host is looked up by its name in the spec, so that a key stays pinned when the address changes. If
    no line has the name, its address is looked up; ssh writes it ``[address]:port`` if the port is not 22.
    """

    lines: tuple[Line, ...] = (Line(_HEADER),)

    def find(self, names: Sequence[str], marker: str = "") -> tuple[str, ...]:
        """The keys of the lines about any of these names, ``"ssh-ed25519 AAAA..."`` each."""
        return tuple(line.key for line in self.lines if line.marker == marker and line.matches(names))

    def keys(self, host: str, address: str, port: int) -> tuple[str, ...]:
        """The pinned keys of a host; empty if it is not known."""
        own, at = _names(host, address, port)
        return self.find(own) or self.find(at)

    def alias(self, host: str, address: str, port: int) -> str:
        """The name that the file has for a host, for ``HostKeyAlias`` of ssh."""
        own, at = _names(host, address, port)
        return next((name for name in own + at if self.find((name,))), own[0])

    def revoked(self, host: str, address: str, port: int) -> tuple[str, ...]:
        """The keys that must not be accepted from this host."""
        own, at = _names(host, address, port)
        return self.find(own + at, REVOKED)

    def pinned(self, host: str, address: str, port: int, keys: Sequence[str]) -> KnownHosts:
        """The same file with ``keys`` as the only ones of a host; other hosts and all comments stay."""
        own, at = _names(host, address, port)
        kept = [line.without(own + at) for line in self.lines]
        place = next((n for n, line in enumerate(kept) if line is not self.lines[n]), len(kept))
        written = ",".join(dict.fromkeys((own[0], *at)))
        kept[place:place] = [_parse_line(f"{written} {key}") for key in keys]
        return KnownHosts(tuple(line for line in kept if line is not None))

    def renamed(self, host: str, new: str, port: int) -> KnownHosts:
        """The same file with ``new`` as the name of a host, without what it had by that name."""
        names = dict(zip(_names(host, host, port)[0], _names(new, new, port)[0], strict=True))
        kept = [line.without(tuple(names.values())) for line in self.lines]
        return KnownHosts(tuple(line.renamed(names) for line in kept if line is not None))

    def dump(self) -> str:
        """The text of the file."""
        return "".join(f"{line.text}\n" for line in self.lines)


def ssh_name(address: str, port: int) -> str:
    """How known_hosts names an SSH server: the address, with the port if that is not 22."""
    return (address if port == 22 else f"[{address}]:{port}").lower()


def _names(host: str, address: str, port: int) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The names of a host in the file: those with its name in the spec, and the one with its address."""
    return (host.lower(), ssh_name(host, port)), (ssh_name(address, port),)


def fingerprint(key: str) -> str:
    """The fingerprint of a key as ``ssh-keygen -l`` prints it: ``SHA256:`` and unpadded base64."""
    raw = PublicBlob.from_string(key).key_blob
    return "SHA256:" + base64.b64encode(hashlib.sha256(raw).digest()).decode().rstrip("=")


def path_beside(spec: Path) -> Path:
    """The file with the pinned keys of ``spec``: ``swarm.known_hosts`` beside ``swarm.yaml``."""
    return spec.with_name(f"{spec.stem}.known_hosts")


def read(path: Path) -> KnownHosts:
    """The pinned keys in the file at ``path``; none if it does not exist. Raises ``OpenSshFileError``.

    A link to elsewhere is refused: a spec from someone else would make errors quote any file.
    """
    if not Path(os.path.realpath(path)).is_relative_to(os.path.realpath(path.parent)):
        raise OpenSshFileError(f"{path}: a link out of its folder; put the file itself there")
    return parse(read_text(path), str(path)) if os.path.lexists(path) else KnownHosts()


def read_valid_lines(path: Path) -> KnownHosts:
    """What ``~/.ssh/known_hosts`` has. Wrong lines are skipped, as by ssh."""
    known = []
    for text in read_text(path).splitlines() if path.is_file() else ():
        with suppress(OpenSshFileError):
            known.append(_parse_line(text))
    return KnownHosts(tuple(known))


def parse(text: str, name: str) -> KnownHosts:
    """Read the text of a known_hosts file strictly; ``name`` stands for the file in errors."""
    lines = text.removesuffix("\n").split("\n")
    return KnownHosts(tuple(_parse_line(line, f"{name}:{at}") for at, line in enumerate(lines, 1) if text))


def _parse_line(text: str, place: str = "") -> Line:
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
    with suppress(ValueError):
        if base64.b64encode(PublicBlob.from_string(" ".join(words[1:3])).key_blob) == words[2].encode():
            return Line(text, tuple(words[0].split(",")), " ".join(words[1:3]), marker)
    raise OpenSshFileError(f"{place}: not a public key: the text after {words[1]} is not a key of that type")


def _hashes(written: str, names: Sequence[str]) -> bool:
    """True if ``written`` (``|1|salt|HMAC-SHA1``, as HashKnownHosts writes it) is one of the names."""
    with suppress(ValueError, AssertionError):  # no base64; a salt of another length
        return written.startswith("|1|") and any(
            paramiko.HostKeys.hash_host(name, written) == written for name in names
        )
    return False
