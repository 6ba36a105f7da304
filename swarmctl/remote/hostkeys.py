"""Pinned host keys: the lock file beside the spec, keys in the words OpenSSH uses. Opens no connection."""

from __future__ import annotations

import base64
import hashlib
import os
import struct
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import yaml

VERSION = 1
_HEADER = (
    "# Host keys that swarmctl trusts, written by `swarmctl trust`. Keep this file beside the spec, in git.\n"
)


class LockFileError(Exception):
    """The lock file is not what it should be; the message says where and what to do."""


class BadKeyError(ValueError):
    """A text that is no public key."""


def parse_key(text: str) -> tuple[str, bytes]:
    """Type and raw bytes of a public key line such as ``ssh-ed25519 AAAA...`` (a comment may follow)."""
    words = text.split()
    if len(words) < 2:
        raise BadKeyError("a key is its type, a space and its base64 text")
    try:
        raw = base64.b64decode(words[1], validate=True)
    except ValueError:
        raise BadKeyError(f"the text after {words[0]} is not base64") from None
    if len(raw) < 4 or raw[4 : 4 + struct.unpack(">I", raw[:4])[0]] != words[0].encode(errors="replace"):
        raise BadKeyError(f"the text after {words[0]} is not a key of that type")
    return words[0], raw


def fingerprint(key: str) -> str:
    """The key's fingerprint as ``ssh-keygen -l`` prints it: ``SHA256:`` and unpadded base64."""
    _, raw = parse_key(key)
    return "SHA256:" + base64.b64encode(hashlib.sha256(raw).digest()).decode().rstrip("=")


@dataclass(frozen=True)
class LockFile:
    """The pinned keys by host name. Any one of a host's keys is good."""

    hosts: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    def keys(self, host: str) -> tuple[str, ...]:
        return self.hosts.get(host, ())

    def pinned(self, host: str, keys: tuple[str, ...]) -> LockFile:
        """The same file with ``keys`` as the only ones of ``host``."""
        return LockFile({**self.hosts, host: keys})

    def dump(self) -> str:
        hosts = {name: {"keys": list(self.hosts[name])} for name in sorted(self.hosts)}
        return _HEADER + yaml.safe_dump({"version": VERSION, "hosts": hosts}, sort_keys=False, width=2**20)


def lock_path(spec: Path) -> Path:
    """Where the pinned keys of ``spec`` live: ``swarm.yaml`` has ``swarm.lock.yaml`` beside it."""
    return spec.with_name(f"{spec.stem}.lock.yaml")


def read_lock(path: Path) -> LockFile:
    """The lock file at ``path``; an absent one pins nothing. Raises ``LockFileError``."""
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        return LockFile()
    except (OSError, UnicodeDecodeError) as error:
        raise LockFileError(f"{path}: cannot be read: {error}") from error
    return parse_lock(text, str(path))


def parse_lock(text: str, name: str) -> LockFile:
    """Read the text of a lock file, strictly. ``name`` is what errors call it."""
    try:
        root = yaml.compose(text, Loader=yaml.SafeLoader)
    except yaml.YAMLError as error:
        raise LockFileError(f"{name}: not valid YAML: {' '.join(str(error).split())}") from error
    if root is None:
        return LockFile()
    reader = _Reader(name)
    top = reader.mapping(root, "the file", {"version", "hosts"})
    version = top.get("version")
    if version is None or version.value != str(VERSION):
        raise reader.error(version or root, f"`version` must be {VERSION}; another swarmctl wrote this file")
    hosts = reader.mapping(top["hosts"], "`hosts`") if "hosts" in top else {}
    return LockFile({host: reader.keys(node, host) for host, node in hosts.items()})


class _Reader:
    """Turns YAML nodes into plain values, or into an error with file, line and column."""

    def __init__(self, name: str) -> None:
        self._name = name

    def error(self, node: yaml.Node, message: str) -> LockFileError:
        mark = node.start_mark
        return LockFileError(f"{self._name}:{mark.line + 1}:{mark.column + 1}: {message}")

    def mapping(self, node: yaml.Node, what: str, allowed: set[str] | None = None) -> dict[str, yaml.Node]:
        if not isinstance(node, yaml.MappingNode):
            raise self.error(node, f"{what} must be a mapping")
        found: dict[str, yaml.Node] = {}
        for key, value in node.value:
            if not isinstance(key, yaml.ScalarNode):
                raise self.error(key, f"{what} must have plain words as keys")
            if key.value in found:
                raise self.error(key, f"`{key.value}` stands twice in {what}")
            if allowed is not None and key.value not in allowed:
                raise self.error(key, f"{what} knows no `{key.value}`, only {' and '.join(sorted(allowed))}")
            found[key.value] = value
        return found

    def keys(self, node: yaml.Node, host: str) -> tuple[str, ...]:
        listed = self.mapping(node, f"host {host}", {"keys"}).get("keys")
        if not isinstance(listed, yaml.SequenceNode) or not listed.value:
            raise self.error(listed or node, f"host {host} needs `keys`, a list of at least one public key")
        return tuple(self._key(item, host) for item in listed.value)

    def _key(self, node: yaml.Node, host: str) -> str:
        if not isinstance(node, yaml.ScalarNode):
            raise self.error(node, f"a key of host {host} must be a text")
        try:
            parse_key(node.value)
        except BadKeyError as error:
            raise self.error(node, f"a key of host {host} is no public key: {error}") from error
        return " ".join(node.value.split()[:2])


def write_lock(path: Path, lock: LockFile) -> None:
    """Write ``lock`` to ``path``; a reader, or a crash, finds the old or the new text, never a part."""
    descriptor, draft = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    try:
        with os.fdopen(descriptor, "w", encoding="utf-8") as file:
            file.write(lock.dump())
            file.flush()
            os.fsync(file.fileno())
        Path(draft).chmod(0o644)
        Path(draft).replace(path)
    except BaseException:
        Path(draft).unlink(missing_ok=True)
        raise
