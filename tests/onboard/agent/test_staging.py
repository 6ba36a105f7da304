"""What is uploaded becomes a release only if it is exactly what its manifest says."""

from __future__ import annotations

import gzip
import io
import json
import os
import subprocess
import tarfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from swarm_onboard.agent import disk, files
from swarm_onboard.agent.errors import RefusedError
from swarm_onboard.agent.files import digest_of
from swarm_onboard.agent.manifest import parse
from swarm_onboard.agent.rpc import Report
from swarm_onboard.agent.staging import unpack
from swarm_onboard.agent.verbs import apply

from swarmctl.remote import agent_client
from swarmctl.render.bundle import Bundle, File
from tests.onboard.agent.fakehost import FakeHost, bundle, payload_of, request_for

RELEASE = Bundle((File("a", b"aaaa"), File("sub/b", b"bb", 0o755)), swarm="new", host="pi")

Member = tuple[tarfile.TarInfo, bytes]


def member(name: str, content: bytes = b"", **changes: Any) -> Member:
    info = tarfile.TarInfo(name)
    info.size = len(content)
    for field, value in changes.items():
        setattr(info, field, value)
    return info, content


GOOD = [member("manifest.json", RELEASE.manifest_bytes), member("a", b"aaaa"), member("sub/b", b"bb")]


def archive(*members: Member) -> bytes:
    stream = io.BytesIO()
    with tarfile.open(fileobj=stream, mode="w:gz") as tar:
        for info, content in members:
            tar.addfile(info, io.BytesIO(content))
    return stream.getvalue()


def test_an_unchanged_file_keeps_its_date_in_the_next_release(tmp_path: Path) -> None:
    """Otherwise systemd would call every unit changed on disk and ask for a reload."""
    host, first, second = FakeHost(tmp_path / "host"), bundle("1"), bundle("2")
    rule = host.prefix / "opt/swarm/new/current/udev/90-swarm.rules"
    host.apply(first)
    before = rule.stat()
    host.apply(second, previous=first.digest)
    assert rule.stat().st_ino != before.st_ino
    assert rule.stat().st_mtime == before.st_mtime


def test_a_good_archive_is_taken() -> None:
    manifest, content, files = unpack(archive(*GOOD), RELEASE.digest)

    assert content == RELEASE.manifest_bytes
    assert files == {"a": b"aaaa", "sub/b": b"bb"}
    assert manifest.files["sub/b"].mode == 0o755


BAD: dict[str, list[Member]] = {
    "a file too many": [*GOOD, member("c", b"c")],
    "a file twice": [*GOOD, member("a", b"aaaa")],
    "a file missing": GOOD[:-1],
    "another content": [GOOD[0], member("a", b"aaab"), GOOD[2]],
    "another size": [GOOD[0], member("a", b"aaaaa"), GOOD[2]],
    "up and away": [*GOOD, member("../../etc/cron.d/x", b"x")],
    "an absolute path": [*GOOD, member("/etc/cron.d/x", b"x")],
    "a symbolic link": [GOOD[0], member("a", type=tarfile.SYMTYPE, linkname="/etc/shadow"), GOOD[2]],
    "a hard link": [GOOD[0], member("a", type=tarfile.LNKTYPE, linkname="/etc/shadow"), GOOD[2]],
    "a device": [GOOD[0], member("a", type=tarfile.CHRTYPE, devmajor=1, devminor=3), GOOD[2]],
    "a fifo": [GOOD[0], member("a", type=tarfile.FIFOTYPE), GOOD[2]],
    "a folder": [GOOD[0], member("a", type=tarfile.DIRTYPE), GOOD[2]],
    "no manifest": GOOD[1:],
    "the manifest last": [*GOOD[1:], GOOD[0]],
    "nothing": [],
}


@pytest.mark.parametrize("members", BAD.values(), ids=BAD.keys())
def test_an_archive_that_is_not_its_manifest_is_refused(members: list[Member]) -> None:
    with pytest.raises(RefusedError):
        unpack(archive(*members), RELEASE.digest)


@pytest.mark.parametrize(
    "damage",
    [lambda data: data[: len(data) // 2], lambda data: b"", lambda data: b"no gzip"],
    ids=["half", "empty", "text"],
)
def test_a_damaged_archive_is_refused(damage: Callable[[bytes], bytes]) -> None:
    with pytest.raises(RefusedError):
        unpack(damage(archive(*GOOD)), RELEASE.digest)


def test_every_single_flipped_bit_is_noticed() -> None:
    tar = gzip.decompress(archive(*GOOD))
    at = tar.index(b"aaaa", tar.index(RELEASE.manifest_bytes) + len(RELEASE.manifest_bytes) + 512 - 4)
    with pytest.raises(RefusedError, match="a was damaged on its way"):
        unpack(gzip.compress(tar[:at] + b"b" + tar[at + 1 :]), RELEASE.digest)


def changed(**changes: Any) -> bytes:
    return json.dumps({**RELEASE.manifest, **changes}).encode()


def entry(**changes: Any) -> dict[str, Any]:
    return {"sha256": "0" * 64, "mode": 0o644, "size": 1, **changes}


HOSTILE = {
    "another format": changed(format=2),
    "a path upwards": changed(files={"../x": entry()}),
    "an absolute path": changed(files={"/x": entry()}),
    "a path through nothing": changed(files={"a//b": entry()}),
    "a path with a line break": changed(files={"a\nb": entry()}),
    "the manifest itself": changed(files={"manifest.json": entry()}),
    "a setuid file": changed(files={"a": entry(mode=0o4755)}),
    "a negative size": changed(files={"a": entry(size=-1)}),
    "a short digest": changed(files={"a": entry(sha256="00")}),
    "a unit that is an option": changed(units=[{"name": "--root=/x"}]),
    "a unit with a path": changed(units=[{"name": "/etc/x.service"}]),
    "a link elsewhere": changed(links={"/etc/passwd": "a"}),
    "a link upwards": changed(links={"/etc/systemd/system/../../passwd": "a"}),
    "a link to a hidden file": changed(links={"/etc/udev/rules.d/.x": "a"}),
    "a link in an unknown folder": changed(links={"/etc/systemd/system/a/b.service": "a"}),
    "a link to what is not there": changed(links={"/etc/systemd/system/a.service": "c"}),
    "a block elsewhere": changed(blocks={"/etc/shadow": "a"}),
}


@pytest.mark.parametrize("content", HOSTILE.values(), ids=HOSTILE.keys())
def test_a_manifest_that_reaches_where_it_must_not_is_refused(content: bytes) -> None:
    with pytest.raises(RefusedError):
        parse(content, digest_of(content)[:16])


def test_a_manifest_under_another_name_is_refused() -> None:
    with pytest.raises(RefusedError, match="not that of release"):
        parse(RELEASE.manifest_bytes, "0" * 16)


def test_links_into_wants_and_udev_are_allowed() -> None:
    content = changed(
        links={
            "/etc/systemd/system/swarm-new.target": "a",
            "/etc/systemd/system/multi-user.target.wants/swarm-new.target": "a",
            "/etc/udev/rules.d/90-swarm-new.rules": "a",
        }
    )
    assert len(parse(content, digest_of(content)[:16]).links) == 3


@contextmanager
def small_disk(path: Path, options: str) -> Iterator[None]:
    subprocess.run(["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(path)], check=True)
    try:
        yield
    finally:
        subprocess.run(["umount", str(path)], check=True)


@pytest.mark.skipif(os.geteuid() != 0, reason="mounting needs root")
@pytest.mark.parametrize(
    ("options", "message"),
    [
        ("size=800k", "the disk is full: {free} KiB free in {place}, "),
        ("nr_inodes=40", "the disk has no inodes left: "),
    ],
    ids=["bytes", "inodes"],
)
def test_a_full_disk_is_noticed_before_anything_is_written(
    tmp_path: Path, options: str, message: str
) -> None:
    host = FakeHost(tmp_path)
    with small_disk(tmp_path / "opt", options):
        reply = host.apply(bundle("1"))

        assert reply.error["kind"] == "refused"
        place = str(tmp_path / "opt")
        assert message.format(free=disk.free(place) // 1024, place=place) in reply.error["message"]
        assert reply.error["hint"].endswith(f" {'in' if 'KiB' in message else 'from'} {place}")
        assert host.observe().releases == []
        assert host.calls() == []


def test_a_disk_that_does_not_keep_what_was_written_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    host, following = FakeHost(tmp_path), bundle("2")
    host.apply(bundle("1"))
    monkeypatch.setenv("SWARM_PREFIX", str(tmp_path))
    monkeypatch.setattr(files, "sync_disk", lambda folder: (Path(folder) / "hosts").write_bytes(b"\0" * 12))
    request = apply.Request("new", "0" * 16, bundle("1").digest, following.digest)

    with pytest.raises(RefusedError, match="hosts did not reach the disk as it was sent"):
        apply.handle(request, payload_of(following), Report("n"))

    assert host.observe().release == bundle("1").digest
    assert host.observe().releases == [bundle("1").digest]


@pytest.mark.skipif(os.geteuid() != 0, reason="mounting needs root")
def test_a_read_only_disk_is_named(tmp_path: Path) -> None:
    host = FakeHost(tmp_path)
    with small_disk(tmp_path / "opt", "size=4m"):
        host.apply(bundle("1"))
        subprocess.run(["mount", "-o", "remount,ro", str(tmp_path / "opt")], check=True)
        reply = host.ask(request_for(bundle("2"), previous=bundle("1").digest), payload_of(bundle("2")))

        assert reply.error["kind"] == "refused"
        assert "Read-only file system" in reply.error["message"]
        assert host.observe().release == bundle("1").digest


def test_contents_of_the_release_before_need_not_travel(tmp_path: Path) -> None:
    host, first, second = FakeHost(tmp_path / "host"), bundle("1"), bundle("2")
    host.apply(first)
    known = {file.digest for file in first.files}
    new = replace(second, files=tuple(file for file in second.files if file.digest not in known))
    sent = agent_client.pack(second.manifest_bytes, {one.path: (one.content, one.mode) for one in new.files})

    change = request_for(second, previous=first.digest, start=[])
    (host.prefix / f"opt/swarm/new/releases/{first.digest}/hosts").write_text("edited")
    refused = host.ask(change, sent)
    assert refused.error["kind"] == "refused"
    assert "lacks hosts" in refused.error["message"]

    host.apply(first, previous=first.digest, start=[])  # repairs it
    assert host.ask(change, sent).answer["release"] == second.digest
    assert host.observe().drift.files == {}
