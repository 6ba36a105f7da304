"""A connection that ends in the upload costs only what was not complete: the next run sends the rest."""

from __future__ import annotations

import io
import json
import random
import tarfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

import pytest

from swarmctl.deploy.host_transaction import Terms
from swarmctl.deploy.outcome import Outcome
from swarmctl.remote.transport import HostError, Kind, Output, Session, Target
from swarmctl.render.bundle import Bundle, File
from tests.deploy.deploying import deploy
from tests.deploy.test_rollout import TARGETS, bundles, deployed
from tests.onboard.agent.fakehost import FakeHost
from tests.onboard.agent.local_session import LocalChannel, LocalSession

OLD = bundles()["k3"]
NEW = replace(
    OLD, files=(*OLD.files, *(File(f"data/{n}", random.Random(n).randbytes(20_000)) for n in range(20)))
)
LOST = HostError(Kind.LOST, "k3: the connection was lost")
KEPT = "opt/swarm/new/state/upload"


@dataclass
class Upload:
    """A connection that ends after ``percent`` of an upload; what of the uploads was written to it."""

    percent: int = 100
    payloads: list[bytes] = field(default_factory=list)

    def part(self, payload: bytes) -> bytes:
        self.payloads.append(payload[: len(payload) * self.percent // 100])
        return self.payloads[-1]

    @property
    def paths(self) -> list[str]:
        """The files in a complete upload."""
        (payload,) = self.payloads
        with tarfile.open(fileobj=io.BytesIO(payload), mode="r:gz") as archive:
            return [name for name in archive.getnames() if name.startswith("data/")]


class CutChannel(LocalChannel):
    """Ends as soon as the part of an upload that ``upload`` lets pass is written."""

    upload: Upload

    def exchange(
        self, stdin: Sequence[bytes], enough: Callable[[bytes], bool], *, timeout: float = 60.0
    ) -> Output:
        if len(stdin) < 2 or json.loads(stdin[-2])["verb"] != "apply":
            return super().exchange(stdin, enough, timeout=timeout)
        *line, payload = stdin
        sent = self.upload.part(payload)
        if sent == payload:
            return super().exchange(stdin, enough, timeout=timeout)
        process = self._process = self._process or self._start()
        assert process.stdin is not None
        for piece in (*line, sent):
            process.stdin.write(piece)
        process.stdin.close()
        raise LOST


@dataclass
class Way:
    host: FakeHost
    upload: Upload

    @contextmanager
    def connect(self, target: Target) -> Iterator[Session]:
        way = self

        class CutSession(LocalSession):
            @contextmanager
            def channel(self, command: str, *, limit: int = 1 << 20) -> Iterator[LocalChannel]:
                with ExitStack() as until_left:
                    made = CutChannel(["/bin/sh", "-c", command], self._env, until_left)
                    made.upload = way.upload
                    yield made

        yield CutSession(self.host.environment())


@pytest.fixture
def host(tmp_path: Path) -> FakeHost:
    made = FakeHost(tmp_path)
    sudo = made.prefix / "bin/sudo"
    sudo.write_text('#!/bin/sh\nshift\nexec "$@"\n')
    sudo.chmod(0o755)
    assert isinstance(run(made, OLD, Upload()), Outcome)
    return made


def run(host: FakeHost, bundle: Bundle, upload: Upload) -> Outcome | HostError:
    terms = Terms(healthy_for=0.0, healthy_within=5)
    return deployed(deploy({"k3": bundle}, TARGETS, Way(host, upload), terms=terms))["k3"]


@pytest.mark.parametrize(("percent", "missing"), [(0, 20), (25, 16), (50, 11), (99, 1)])
def test_the_next_run_sends_only_what_was_not_complete(host: FakeHost, percent: int, missing: int) -> None:
    first, second = Upload(percent), Upload()

    assert run(host, NEW, first) == LOST
    assert host.observe().release == OLD.digest
    assert isinstance(run(host, NEW, second), Outcome)

    assert len(second.paths) == missing
    assert len(second.payloads[0]) < missing * 20_000 + 5_000
    assert host.read("opt/swarm/new/current/data/0") == NEW.files[-20].content
    assert not (host.prefix / KEPT).exists()


def test_what_an_upload_left_is_read_by_root_alone_and_checked(host: FakeHost) -> None:
    run(host, NEW, Upload(50))
    folder = host.prefix / KEPT
    assert folder.stat().st_mode & 0o777 == 0o700
    damaged = max(folder.iterdir())
    damaged.write_bytes(b"half")

    again = Upload()
    assert isinstance(run(host, NEW, again), Outcome)
    assert len(again.paths) == 12


def test_only_files_of_the_last_upload_are_kept(host: FakeHost) -> None:
    other = replace(NEW, files=(*OLD.files, File("data/other", random.Random(99).randbytes(20_000))))
    run(host, NEW, Upload(50))
    run(
        host,
        replace(other, files=(*other.files, File("data/zz", random.Random(98).randbytes(80_000)))),
        Upload(60),
    )
    assert [path.name for path in (host.prefix / KEPT).iterdir()] == [other.files[-1].digest]
