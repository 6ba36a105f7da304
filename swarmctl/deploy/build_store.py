"""Builds of packages: made on their builders, and kept on the side of the operator."""

from __future__ import annotations

import base64
import binascii
import gzip
import io
import json
import os
import tarfile
import threading
import zlib
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from swarm_onboard.agent.verbs import build_packages, fetch_build

from swarmctl.deploy import journal
from swarmctl.deploy.prepare import Prepared
from swarmctl.plan.host_builds import Build, keys_of
from swarmctl.remote import agent_client, parallel_hosts
from swarmctl.remote.ask import ask
from swarmctl.remote.transport import AgentSession, HostError, Kind, Session, Target, Transport
from swarmctl.resources import cache_folder
from swarmctl.ros_packages.builds import Built
from swarmctl.ros_packages.package import DeliveredPackage
from swarmctl.swarm.resolved import Swarm
from swarmctl.swarm.used_packages import in_swarm


@dataclass(frozen=True)
class LruCacheDir:
    """Files with names of the caller and one ``suffix``; of all together ``max_bytes`` are kept."""

    folder: Path
    suffix: str
    max_bytes: int

    def names(self) -> frozenset[str]:
        """Returns the names of the files, without the suffix."""
        return frozenset(one.name.removesuffix(self.suffix) for one in self._files())

    def find(self, name: str) -> bytes | None:
        """Returns the content of a file, which counts as new again; None if it cannot be read."""
        path = self._path(name)
        try:
            content = path.read_bytes()
            path.touch()
        except OSError:
            return None
        return content

    def keep(self, name: str, content: bytes) -> None:
        """Writes a file, and removes the oldest ones beyond ``max_bytes``. Raises ``OSError``."""
        self.folder.mkdir(parents=True, exist_ok=True)
        draft = self.folder / f".{name}.{os.getpid()}.{threading.get_ident()}"
        try:
            draft.write_bytes(content)
            draft.replace(self._path(name))
        finally:
            draft.unlink(missing_ok=True)
        self._remove_oldest()

    def _remove_oldest(self) -> None:
        kept = 0
        stored = [(one.stat(), one) for one in self._files()]
        for state, path in sorted(stored, key=lambda one: one[0].st_mtime_ns, reverse=True):
            kept += state.st_size
            if kept > self.max_bytes:
                path.unlink(missing_ok=True)

    def _files(self) -> list[Path]:
        return list(self.folder.glob(f"[!.]*{self.suffix}"))

    def _path(self, name: str) -> Path:
        return self.folder / f"{name}{self.suffix}"


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


_VERBS = ("build_packages", "fetch_build")
_BUILD_TIMEOUT = 7500.0  # s; above the agent's own limit
_LARGEST = 512 << 20  # bytes of one packed result


def build(
    swarm: Swarm,
    builds: Sequence[Build],
    targets: Mapping[str, Target],
    transport: Transport,
    store: BuildStore,
    *,
    parallel: int,
    stop: parallel_hosts.Stop | None = None,
) -> Iterator[parallel_hosts.Event[Prepared]]:
    """Carries out the builds, one of each builder; a failure stays with its builder."""
    by_builder = {one.builder: one for one in builds}

    def work(session: Session, target: Target, note: Callable[[str], None]) -> Prepared:
        due = by_builder[target.host]
        with agent_client.agent_session(session, verbs=_VERBS) as host:
            _carry_out(host, swarm, due, store, note)
        return Prepared(due.steps)

    return parallel_hosts.run(
        [targets[name] for name in by_builder], work, transport=transport, parallel=parallel, stop=stop
    )


def _carry_out(
    host: AgentSession, swarm: Swarm, due: Build, store: BuildStore, note: Callable[[str], None]
) -> None:
    builder = swarm.hosts[due.builder]
    request = build_packages.Request(
        swarm.name,
        builder.user,
        list(builder.workspaces),
        list(due.keys),
        {one.name: one.folder for one in due.sources},
    )
    note(f"building {', '.join(due.keys)}")
    payload = sources(due.sources)
    answer = ask(host, build_packages.handle, request, payload, on_note=note, timeout=_BUILD_TIMEOUT)
    if answer.platform != due.platform:
        raise HostError(Kind.REFUSED, f"it is {answer.platform} now", "run the same command again")
    for name, key in due.keys.items():
        archive = _fetched(host, swarm.name, name, answer.sizes.get(name, 0), note)
        try:
            store.keep(key, archive)
        except DamagedBuildError as error:
            raise HostError(Kind.PROTOCOL, f"the build of {name} is damaged: {error}") from error
        except OSError as error:
            raise HostError(
                Kind.REFUSED, f"the build of {name} cannot be kept in {store.folder}: {error.strerror}"
            ) from error


def _fetched(host: AgentSession, swarm: str, name: str, size: int, note: Callable[[str], None]) -> bytes:
    if not 0 < size <= _LARGEST:
        raise HostError(Kind.PROTOCOL, f"the build of {name} has {size} bytes")
    found = b""
    while len(found) < size:
        request = fetch_build.Request(swarm, name, len(found))
        try:
            piece = base64.b64decode(ask(host, fetch_build.handle, request).data, validate=True)
        except binascii.Error as error:
            raise HostError(Kind.PROTOCOL, f"the build of {name} is not base64") from error
        if not piece:
            raise HostError(Kind.PROTOCOL, f"the build of {name} ends early", "run the same command again")
        found += piece
        note(f"{name}: {len(found) * 100 // size} % of {size / 1e6:.1f} MB")
    return found


def sources(packages: Sequence[DeliveredPackage]) -> bytes:
    """Returns the packages as a tar.gz of ``PACKAGE/path``. Same files, same bytes."""
    stream = io.BytesIO()
    with (
        gzip.GzipFile(fileobj=stream, mode="wb", compresslevel=6, mtime=0) as packed,
        tarfile.open(fileobj=packed, mode="w", format=tarfile.PAX_FORMAT) as archive,
    ):
        for one in packages:
            for path, (content, may) in sorted(one.files.items()):
                member = tarfile.TarInfo(f"{one.name}/{path}")
                member.size = len(content)
                member.mode = 0o755 if may else 0o644
                archive.addfile(member, io.BytesIO(content))
    return stream.getvalue()
