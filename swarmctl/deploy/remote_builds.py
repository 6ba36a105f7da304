"""Has packages built on their builders, in parallel, and keeps the results."""

from __future__ import annotations

import base64
import binascii
import gzip
import io
import tarfile
from collections.abc import Callable, Iterator, Mapping, Sequence

from swarm_onboard.agent.verbs import build_packages, fetch_build

from swarmctl.deploy.build_store import BuildStore, DamagedBuildError
from swarmctl.deploy.prepare import Prepared
from swarmctl.plan.host_builds import Build
from swarmctl.remote import agent_client, parallel_hosts
from swarmctl.remote.ask import ask
from swarmctl.remote.transport import AgentSession, HostError, Kind, Session, Target, Transport
from swarmctl.ros_packages.package import DeliveredPackage
from swarmctl.swarm.resolved import Swarm

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
