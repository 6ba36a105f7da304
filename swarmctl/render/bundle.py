"""What one host gets, as a value: files, units, and the few places outside its release that point into it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

ROOT = "/opt/swarm"
MANIFEST = "manifest.json"
FORMAT = 1
_PACKAGE, _WORKSPACE = "package:", "workspace:"


def digest_of(content: bytes) -> str:
    """SHA-256 of ``content`` in hexadecimal."""
    return hashlib.sha256(content).hexdigest()


def package(name: str) -> str:
    """The requirement that a host has this ROS package."""
    return _PACKAGE + name


def workspace(path: str) -> str:
    """The requirement that a host has a built ROS workspace at this place."""
    return _WORKSPACE + path


def required(requirement: str) -> tuple[str, str]:
    """What a requirement is (`package`, `workspace`, or nothing for a part of ROS), and its name or place."""
    kind, mark, name = requirement.partition(":")
    return (kind, name) if mark else ("", kind)


@dataclass(frozen=True)
class File:
    """One file of a release. ``path`` is relative to the release; ``origin`` names its entry in the spec."""

    path: str
    content: bytes
    mode: int = 0o644
    origin: str = ""

    @cached_property
    def digest(self) -> str:
        return digest_of(self.content)


@dataclass(frozen=True)
class Unit:
    """A systemd unit, in start order. It restarts when, and only when, one of the files it ``needs`` changes.

    ``robot`` names the robot that must stand still before this unit is stopped, if it drives one; ``program``
    the program that it runs; ``packages`` the ROS packages without which it is skipped.
    """

    name: str
    needs: tuple[str, ...]
    robot: str = ""
    program: str = ""
    packages: tuple[str, ...] = ()
    secret: str = ""


@dataclass(frozen=True)
class Bundle:
    """Everything one host gets. Same spec, same bytes, same digest.

    ``links`` maps an absolute path on the host to a path in the release (a symlink through ``current``);
    ``blocks`` maps an absolute path to the release file whose text stands there between two marker lines;
    ``wants`` names programs without which a part of its preparation does nothing (``chronyd``, ``iw``),
    ``follows`` the host whose clock it follows, ``secrets`` those that its units read, by name;
    ``requires`` names what the host must have for its units to run: ``rospy``, ``roscore``, ``pyserial``, and
    what ``package`` and ``workspace`` make of the names of ROS packages and the places of built workspaces.
    """

    swarm: str
    host: str
    files: tuple[File, ...]
    units: tuple[Unit, ...] = ()
    links: Mapping[str, str] = field(default_factory=dict)
    blocks: Mapping[str, str] = field(default_factory=dict)
    requires: tuple[str, ...] = ()
    wants: tuple[str, ...] = ()
    follows: str = ""
    secrets: tuple[str, ...] = ()

    @property
    def asks(self) -> tuple[str, ...]:
        """What the host is asked for: all that it must have, and what optional programs would need."""
        wished = (package(name) for unit in self.units for name in unit.packages)
        return tuple(dict.fromkeys((*self.requires, *wished)))

    @property
    def home(self) -> str:
        """The swarm's folder on the host, ``/opt/swarm/<name>``."""
        return f"{ROOT}/{self.swarm}"

    @cached_property
    def manifest(self) -> dict[str, Any]:
        """The release as data: digests, modes, units with the digest of what each needs, links and blocks."""
        digests = {file.path: file.digest for file in self.files}
        return {
            "format": FORMAT,
            "swarm": self.swarm,
            "host": self.host,
            "files": {
                file.path: {"sha256": file.digest, "mode": file.mode, "size": len(file.content)}
                for file in sorted(self.files, key=lambda file: file.path)
            },
            "units": [
                {
                    "name": unit.name,
                    "needs": list(unit.needs),
                    "robot": unit.robot,
                    "digest": digest_of("".join(digests[path] for path in unit.needs).encode()),
                }
                for unit in self.units
            ],
            "links": dict(sorted(self.links.items())),
            "blocks": dict(sorted(self.blocks.items())),
            "secrets": sorted(self.secrets),
        }

    @cached_property
    def manifest_bytes(self) -> bytes:
        return (json.dumps(self.manifest, indent=1, sort_keys=True) + "\n").encode()

    @cached_property
    def digest(self) -> str:
        """The release's name: the first 16 hexadecimal digits of the manifest's SHA-256."""
        return digest_of(self.manifest_bytes)[:16]
