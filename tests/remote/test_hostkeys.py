"""Pinned keys: the fingerprints people compare, and a lock file that is read strictly and written whole."""

from __future__ import annotations

import subprocess
from contextlib import suppress
from pathlib import Path

import pytest
import sshd as servers
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.remote.hostkeys import (
    BadKeyError,
    LockFile,
    LockFileError,
    fingerprint,
    lock_path,
    parse_key,
    parse_lock,
    read_lock,
    write_lock,
)

KEY = "ssh-ed25519 AAAAC3NzaC1lZDI1NTE5AAAAIKtD9YR1fVNbrHbYPbC6SH4ZeS2tY1uTPyL1nJD4rDVe"
OTHER = "ssh-ed25519 AAAAC3NzaC1lZDI1NTE5AAAAIBBBBBBBBBBBBBBBBBBBBBBBBBBBBBBBBBBBBBBBBBBB"


@pytest.mark.parametrize("kind", ["ed25519", "ecdsa", "rsa"])
def test_fingerprints_are_those_of_openssh(tmp_path: Path, kind: str) -> None:
    if lacking := servers.missing():
        pytest.skip(f"needs {lacking}")
    key = servers.make_key(tmp_path / "key", kind)
    printed = subprocess.run(
        ["ssh-keygen", "-lf", tmp_path / "key.pub"], capture_output=True, text=True, check=True
    ).stdout
    assert fingerprint(key) == printed.split()[1]


@pytest.mark.parametrize(
    "text",
    ["", "ssh-ed25519", "ssh-ed25519 !!!", "ssh-ed25519 AAAA", "ssh-rsa " + KEY.split()[1], "ssh-rsa AAA"],
)
def test_what_is_no_key_is_refused(text: str) -> None:
    with pytest.raises(BadKeyError):
        parse_key(text)


@given(st.text())
def test_no_text_is_a_crash(text: str) -> None:
    with suppress(BadKeyError):
        parse_key(text)
    with suppress(LockFileError):
        parse_lock(text, "x.lock.yaml")


NAMES = st.from_regex(r"[a-z][a-z0-9-]{0,30}", fullmatch=True) | st.sampled_from(
    ["on", "null", "10.0.0.1", "fe80::1"]
)


@given(st.dictionaries(NAMES, st.lists(st.sampled_from([KEY, OTHER]), min_size=1, max_size=2).map(tuple)))
def test_what_is_written_is_what_is_read(hosts: dict[str, tuple[str, ...]]) -> None:
    assert parse_lock(LockFile(hosts).dump(), "x").hosts == hosts


def test_the_lock_file_stands_beside_the_spec(tmp_path: Path) -> None:
    assert lock_path(Path("lab/swarm.yaml")) == Path("lab/swarm.lock.yaml")
    assert read_lock(tmp_path / "absent.lock.yaml") == LockFile()


def test_pinning_replaces_what_was_pinned() -> None:
    lock = LockFile({"a": (KEY,), "b": (KEY,)}).pinned("a", (OTHER,))
    assert (lock.keys("a"), lock.keys("b"), lock.keys("c")) == ((OTHER,), (KEY,), ())


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("version: 2\nhosts: {}", "x:1:10: `version` must be 1"),
        ("hosts: {}", "x:1:1: `version` must be 1"),
        ("- a", "x:1:1: the file must be a mapping"),
        ("version: 1\nhost: {}", "x:2:1: the file knows no `host`, only hosts and version"),
        ("version: 1\nhosts: []", "x:2:8: `hosts` must be a mapping"),
        ("version: 1\nhosts:\n  a: {keys: []}", "x:3:13: host a needs `keys`"),
        ("version: 1\nhosts:\n  a: {}", "x:3:6: host a needs `keys`"),
        ("version: 1\nhosts:\n  a: {keys: [x y]}", "x:3:14: a key of host a is no public key"),
        ("version: 1\nhosts:\n  a: {keys: [[]]}", "x:3:14: a key of host a must be a text"),
        (
            f"version: 1\nhosts:\n  a: {{keys: [{KEY}]}}\n  a: {{keys: [{KEY}]}}",
            "x:4:3: `a` stands twice in `hosts`",
        ),
        ("version: [", "x: not valid YAML"),
    ],
)
def test_errors_say_where_and_what(text: str, message: str) -> None:
    with pytest.raises(LockFileError) as caught:
        parse_lock(text, "x")
    assert str(caught.value).startswith(message)


def test_a_write_that_fails_leaves_the_old_file_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "swarm.lock.yaml"
    write_lock(path, LockFile({"a": (KEY,)}))
    before = path.read_text()

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(OSError, match="No space"):
        write_lock(path, LockFile({"a": (OTHER,)}))
    assert path.read_text() == before
    assert list(tmp_path.iterdir()) == [path]
