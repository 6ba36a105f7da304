"""Keeps builds of packages on the operator's side, by key, and which platform each host has."""

from __future__ import annotations

import gzip
import io
import json
import os
import tarfile
import zlib
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from swarmctl.deploy import journal
from swarmctl.deploy.lru_cache_dir import LruCacheDir
from swarmctl.plan.host_builds import keys_of
from swarmctl.resources import cache_folder
from swarmctl.ros_packages.builds import Built
from swarmctl.swarm.resolved import Swarm
from swarmctl.swarm.used_packages import in_swarm

MAX_BYTES = 2 << 30  # of all builds; the oldest go first
MAX_UNPACKED = 512 << 20  # of one build


class DamagedBuildError(ValueError):
    """A build that is not an archive of plain files."""


@dataclass(frozen=True)
class BuildStore:
    """The folder of all builds; one file each."""

    folder: Path

    def keys(self) -> frozenset[str]:
        """Returns the keys of the builds that are stored."""
        return self._files.names()

    def find(self, key: str) -> Built | None:
        """Returns the files of a build; None if it is missing or damaged."""
        archive = self._files.find(key)
        try:
            return None if archive is None else unpacked(archive)
        except DamagedBuildError:
            return None

    def keep(self, key: str, archive: bytes) -> None:
        """Stores a build, atomically; removes the oldest ones beyond ``MAX_BYTES``.

        Raises ``OSError`` and ``DamagedBuildError``.
        """
        unpacked(archive)
        self._files.keep(key, archive)

    @property
    def _files(self) -> LruCacheDir:
        return LruCacheDir(self.folder, ".tar.gz", MAX_BYTES)


def store() -> BuildStore:
    """Returns the store of this operator."""
    return BuildStore(cache_folder() / "builds")


def unpacked(archive: bytes) -> Built:
    """Returns the files of a packed build, whose checksum is right. Raises ``DamagedBuildError``."""
    found: dict[str, tuple[bytes, bool]] = {}
    try:
        with gzip.GzipFile(fileobj=io.BytesIO(archive)) as stream:
            plain = stream.read(MAX_UNPACKED + 1)  # compares the checksum where it ends
        if len(plain) > MAX_UNPACKED:
            raise DamagedBuildError(f"it is larger than {MAX_UNPACKED >> 20} MiB")
        with tarfile.open(fileobj=io.BytesIO(plain), mode="r:") as packed:
            for member in packed:
                parts = member.name.split("/")
                is_plain = member.isreg() and member.size >= 0 and not {"", ".", ".."} & set(parts)
                if not is_plain or parts[0] != "lib":
                    raise DamagedBuildError(f"{member.name!r} cannot be a file of a build")
                content = packed.extractfile(member)
                found[member.name] = (content.read() if content else b"", bool(member.mode & 0o100))
    except DamagedBuildError:
        raise
    except (tarfile.TarError, zlib.error, EOFError, OSError, ValueError) as error:
        raise DamagedBuildError(f"it is not a tar.gz: {error}") from error
    return found


def with_builds(swarm: Swarm, lab: str = "") -> Swarm:
    """Returns the swarm with the known platforms of its hosts and the stored builds for them.

    ``lab``: the name of the lab whose hosts are meant; empty for the real ones.
    """
    if not any(one.built_by for one in in_swarm(swarm)):
        return swarm
    platforms = known_platforms(swarm.name, lab)
    hosts = {name: replace(host, platform=platforms.get(name, "")) for name, host in swarm.hosts.items()}
    keys = {
        key for name in hosts if platforms.get(name) for key in keys_of(swarm, name, platforms[name]).values()
    }
    own = store()
    found = {key: built for key in sorted(keys) if (built := own.find(key)) is not None}
    return replace(swarm, hosts=hosts, builds=found)


def known_platforms(swarm: str, lab: str) -> Mapping[str, str]:
    """Returns the platform of each host that `prepare` has seen."""
    try:
        known = json.loads(_platforms_file(swarm, lab).read_text("utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    pairs: Iterable[tuple[object, object]] = known.items() if isinstance(known, dict) else ()
    return {str(host): one for host, one in pairs if isinstance(one, str)}


def remember_platforms(swarm: str, lab: str, platforms: Mapping[str, str], hosts: Collection[str]) -> None:
    """Stores the platforms of hosts beside those known already, atomically. Raises ``OSError``.

    ``hosts``: all of the spec; others are forgotten.
    """
    path = _platforms_file(swarm, lab)
    path.parent.mkdir(parents=True, exist_ok=True)
    whole = {**known_platforms(swarm, lab), **platforms}
    draft = path.with_name(f".{path.name}.{os.getpid()}")
    draft.write_text(json.dumps({name: whole[name] for name in hosts if name in whole}), "utf-8")
    draft.replace(path)


def _platforms_file(swarm: str, lab: str) -> Path:
    return journal.folder(swarm) / "platforms" / (f"lab-{lab}.json" if lab else "hosts.json")
