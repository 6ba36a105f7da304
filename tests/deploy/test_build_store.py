"""The operator's store of builds: whole or not there, bounded, and no file outside of it."""

from __future__ import annotations

import errno
import gzip
import io
import os
import random
import tarfile
from pathlib import Path

import pytest

from swarmctl.deploy import build_store
from swarmctl.deploy.build_store import BuildStore, DamagedBuildError, unpacked


def packed(*members: tuple[str, bytes], kind: bytes = tarfile.REGTYPE) -> bytes:
    stream = io.BytesIO()
    with tarfile.open(fileobj=stream, mode="w:gz") as archive:
        for name, content in members:
            member = tarfile.TarInfo(name)
            member.size, member.type, member.mode = len(content), kind, 0o755
            archive.addfile(member, io.BytesIO(content))
    return stream.getvalue()


LARGE = packed(("lib/a", random.Random(3).randbytes(200_000).hex().encode()))


def broken_inside() -> bytes:
    """With bytes in the middle that deflate does not know."""
    middle = len(LARGE) // 2
    return LARGE[:middle] + b"\xff" * 2000 + LARGE[middle + 2000 :]


def other_bytes() -> bytes:
    """With other bytes in the middle, which deflate knows."""
    large = packed(("lib/a", random.Random(3).randbytes(200_000)))
    return large[:100_000] + b"other" + large[100_005:]


def another_content() -> bytes:
    """With the checksum of ``LARGE``."""
    plain = gzip.decompress(LARGE).replace(b"lib/a", b"lib/c", 1)
    return gzip.compress(plain)[:-8] + LARGE[-8:]


def of_negative_size() -> bytes:
    plain = bytearray(gzip.decompress(packed(("lib/a", b"1"))))
    plain[124:136] = b"\xff" * 12  # the size, in base 256
    plain[148:156] = b" " * 8
    plain[148:156] = b"%06o\0 " % sum(plain[:512])
    return gzip.compress(bytes(plain))


def test_a_build_is_found_as_it_was_kept(tmp_path: Path) -> None:
    store = BuildStore(tmp_path / "builds")
    assert (store.keys(), store.find("a")) == (frozenset(), None)
    store.keep("a", packed(("lib/nav/node", b"1")))
    assert store.keys() == {"a"}
    assert store.find("a") == {"lib/nav/node": (b"1", True)}


def test_a_full_disk_leaves_nothing_of_a_build(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(path: Path, content: bytes) -> int:
        path.touch()
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OSError, match="No space left"):
        BuildStore(tmp_path).keep("a", packed(("lib/a", b"1")))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "archive",
    [
        b"no archive",
        packed(("lib/a", b"1"))[:-20],
        broken_inside(),
        other_bytes(),
        another_content(),
        of_negative_size(),
        packed(("lib/../../a", b"1")),
        packed(("/lib/a", b"1")),
        packed(("share/a", b"1")),
        packed(("lib/a", b""), kind=tarfile.SYMTYPE),
    ],
    ids=[
        "text",
        "cut",
        "no deflate",
        "other bytes",
        "another checksum",
        "a negative size",
        "upwards",
        "absolute",
        "elsewhere",
        "link",
    ],
)
def test_what_is_no_build_is_not_kept(tmp_path: Path, archive: bytes) -> None:
    with pytest.raises(DamagedBuildError):
        BuildStore(tmp_path).keep("a", archive)
    (tmp_path / "a.tar.gz").write_bytes(archive)
    assert BuildStore(tmp_path).find("a") is None


def test_a_huge_build_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(build_store, "MAX_UNPACKED", 10)
    with pytest.raises(DamagedBuildError):
        unpacked(packed(("lib/a", b"12345"), ("lib/b", b"123456")))


def test_builds_that_are_not_used_go_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store = BuildStore(tmp_path)
    archive = packed(("lib/a", os.urandom(100)))
    monkeypatch.setattr(build_store, "MAX_BYTES", 2 * len(archive))
    for age, key in enumerate("abc"):
        store.keep(key, archive)
        os.utime(tmp_path / f"{key}.tar.gz", (age, age))
    assert store.find("a") is None
    assert store.find("b") is not None
    store.keep("d", archive)
    assert store.keys() == {"b", "d"}


def test_platforms_of_labs_and_hosts_are_kept_apart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    build_store.remember_platforms("s", "", {"a": "debian-12-x86_64", "gone": "x"}, ["a"])
    build_store.remember_platforms("s", "", {"b": "ubuntu-20.04-aarch64"}, ["a", "b"])
    build_store.remember_platforms("s", "lab", {"a": "debian-12-aarch64"}, ["a"])
    assert build_store.known_platforms("s", "") == {"a": "debian-12-x86_64", "b": "ubuntu-20.04-aarch64"}
    assert build_store.known_platforms("s", "lab") == {"a": "debian-12-aarch64"}
    assert build_store.known_platforms("s", "other") == {}
