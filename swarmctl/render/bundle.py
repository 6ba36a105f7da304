"""What one host gets, as a value: files, units, and the places outside its release that point into it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

from swarm_onboard.agent import paths
from swarm_onboard.agent.manifest import FORMAT

from swarmctl.plugins import MIDDLEWARES
from swarmctl.render.manifest import (
    FileData,
    ManifestData,
    digest_of,
    manifest_bytes,
    release_digest,
    unit_data,
)

#: The folder of every swarm on a host.
ROOT = paths.ROOT
_PACKAGE, _WORKSPACE = "package:", "workspace:"
_IP_LIST = b"\n# The IP list"  # ends the file of a unit that has one


#: What a secret may hold that is not a PIN: one line for a variable, any text for a file.
SecretForm = Literal["line", "text"]


def package(name: str) -> str:
    """Returns the requirement that a host has this ROS package."""
    return _PACKAGE + name


def workspace(path: str) -> str:
    """Returns the requirement that a host has a built ROS workspace at this place."""
    return _WORKSPACE + path


def required(requirement: str) -> tuple[str, str]:
    """Returns the kind of a requirement (`package`, `workspace`, empty for a program) and its name."""
    kind, mark, name = requirement.partition(":")
    return (kind, name) if mark else ("", kind)


def in_words(requirements: Iterable[str]) -> str:
    """Returns requirements as a list for people."""
    words = {"": "", "package": "the ROS package ", "workspace": "a built ROS workspace in "}
    return ", ".join(words[kind] + name for kind, name in map(required, requirements))


@dataclass(frozen=True)
class File:
    """One file of a release. ``path`` is relative to the release; ``origin`` names its entry in the spec.

    ``fixed``: its content without what the program that reads it takes while it runs, if there is any.
    """

    path: str
    content: bytes
    mode: int = 0o644
    origin: str = ""
    fixed: bytes = b""

    @cached_property
    def digest(self) -> str:
        """The digest of the file's content."""
        return digest_of(self.content)

    @cached_property
    def restart_digest(self) -> str:
        """The digest of what a unit restarts for: systemd applies its IP list at the next daemon-reload."""
        if _IP_LIST not in self.content:
            return self.digest
        return digest_of(self.content.partition(_IP_LIST)[0])

    @cached_property
    def manifest_entry(self) -> FileData:
        """Its entry in the manifest; files of the driver are the same on all hosts."""
        return {"sha256": self.digest, "mode": self.mode, "size": len(self.content)}


@dataclass(frozen=True)
class Unit:
    """A systemd unit, in start order. It restarts when, and only when, one of the files it ``needs`` changes;
    it reloads if no more of them changes than its program takes while it runs.

    ``robot`` names the robot that must stand still before this unit is stopped, if it drives one; ``program``
    the program that it runs; ``packages`` the ROS packages without which it is skipped. One ``in_trials``
    runs in trials alone.
    """

    name: str
    needs: tuple[str, ...]
    robot: str = ""
    program: str = ""
    packages: tuple[str, ...] = ()
    secrets: tuple[str, ...] = ()
    in_trials: bool = False


@dataclass(frozen=True)
class Enclave:
    """An enclave of SROS 2: the common name of its certificate, and what the authority signs for it.

    ``folder`` is where its files are beside the spec, ``key`` the secret that is its private key. It is
    ``complete`` if the keystore has its certificate, and these texts signed as they are.
    """

    name: str
    subject: str
    folder: str
    key: str
    governance: bytes
    permissions: bytes
    complete: bool


@dataclass(frozen=True)
class Part:
    """What one concern (ROS, the multimaster, the operating system) adds to a host's bundle.

    The file of a unit is ``units/<its name>``; units are in start order.
    ``links`` maps an absolute path on the host to a path in the release (a symlink through ``current``);
    ``blocks`` maps an absolute path to the release file whose text stands there between two marker lines;
    ``wants`` names programs without which a part of its preparation does nothing (``chronyd``, ``iw``),
    ``follows`` the host whose clock it follows, ``secrets`` those that its units read, by name,
    and ``secret_forms`` what those of them may hold that are no PIN;
    ``requires`` names what the host must have for its units to run: programs, ``rospy``, ``pyserial``,
    ``tf2_msgs``, and what ``package`` and ``workspace`` make of names of ROS packages and places of built
    workspaces; both have by requirement the entries of the spec that need it: ``robots.k3``;
    ``platform`` is the one that its compiled packages are for, empty without any, and ``unbuilt`` names
    packages whose build is missing; ``enclaves`` are those of SROS 2 in which its units run;
    ``wireguard_keys`` has the public keys that the host must know, in lines of ``swarm_onboard.tunnel.keys``,
    and ``unpinned`` the hosts whose key it needs and the spec does not have; ``by_hand`` is what a person
    sets on a robot itself, a sentence each.
    """

    files: tuple[File, ...] = ()
    units: tuple[Unit, ...] = ()
    links: Mapping[str, str] = field(default_factory=dict)
    blocks: Mapping[str, str] = field(default_factory=dict)
    requires: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    wants: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    follows: str = ""
    secrets: tuple[str, ...] = ()
    secret_forms: Mapping[str, SecretForm] = field(default_factory=dict)
    platform: str = ""
    unbuilt: tuple[str, ...] = ()
    enclaves: tuple[Enclave, ...] = ()
    wireguard_keys: str = ""
    unpinned: tuple[str, ...] = ()
    by_hand: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Bundle(Part):
    """Everything one host gets: all its parts. The same spec gives the same bytes and the same digest.

    ``distro`` is the ROS distribution that what it requires belongs to.
    """

    swarm: str
    host: str
    distro: str = MIDDLEWARES.default

    @property
    def unsigned(self) -> list[str]:
        """The enclaves whose files are missing beside the spec, or signed otherwise."""
        return [one.name for one in self.enclaves if not one.complete]

    @property
    def asks(self) -> tuple[str, ...]:
        """What to look for on the host: its requirements, and those of optional programs."""
        optional = (package(name) for unit in self.units for name in unit.packages)
        return tuple(dict.fromkeys((*self.requires, *optional)))

    @property
    def home(self) -> str:
        """The swarm's folder on the host, ``/opt/swarm/<name>``."""
        return f"{ROOT}/{self.swarm}"

    @cached_property
    def manifest(self) -> ManifestData:
        """The release as data: files with digests and modes, units, links and blocks."""
        digests = {file.path: file.restart_digest for file in self.files}
        fixed = {file.path: digest_of(file.fixed) for file in self.files if file.fixed}
        return {
            "format": FORMAT,
            "swarm": self.swarm,
            "host": self.host,
            "files": {
                file.path: file.manifest_entry for file in sorted(self.files, key=lambda file: file.path)
            },
            "units": [
                unit_data(unit.name, unit.needs, unit.robot, unit.secrets, digests=digests, fixed=fixed)
                for unit in self.units
            ],
            "links": dict(sorted(self.links.items())),
            "blocks": dict(sorted(self.blocks.items())),
            "secrets": sorted(self.secrets),
        }

    @cached_property
    def manifest_bytes(self) -> bytes:
        """The manifest as it is written on the host; its digest names the release."""
        return manifest_bytes(self.manifest)

    @cached_property
    def digest(self) -> str:
        """The name of the release: 16 hexadecimal digits."""
        return release_digest(self.manifest_bytes)
