"""The known_hosts file beside the spec: strict, lossless, and read by OpenSSH's own tools."""

from __future__ import annotations

import shutil
import subprocess
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.remote.known_hosts import (
    KnownHosts,
    fingerprint,
    parse,
    path_beside,
    read,
    read_valid_lines,
)
from swarmctl.remote.openssh_files import OpenSshFileError
from tests.remote import sshd as servers
from tests.remote.sshd import Sshd

KEY = "ssh-ed25519 AAAAC3NzaC1lZDI1NTE5AAAAIKtD9YR1fVNbrHbYPbC6SH4ZeS2tY1uTPyL1nJD4rDVe"
OTHER = "ssh-ed25519 AAAAC3NzaC1lZDI1NTE5AAAAIBBBBBBBBBBBBBBBBBBBBBBBBBBBBBBBBBBBBBBBBBBB"

needs_ssh_keygen = pytest.mark.skipif(
    shutil.which("ssh-keygen") is None, reason="needs ssh-keygen (apt install openssh-client)"
)


def keygen(*arguments: str | Path) -> str:
    return subprocess.run(
        ["ssh-keygen", *arguments], capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL
    ).stdout


NAMES = st.from_regex(r"[a-z][a-z0-9-]{0,30}", fullmatch=True) | st.sampled_from(["on", "null"])
KEYS = st.lists(st.sampled_from([KEY, OTHER]), min_size=1, max_size=2, unique=True).map(tuple)


@given(st.dictionaries(NAMES, st.tuples(KEYS, st.sampled_from([22, 2222]))))
def test_what_is_written_is_what_is_read(hosts: dict[str, tuple[tuple[str, ...], int]]) -> None:
    known = KnownHosts()
    for at, (name, (keys, port)) in enumerate(hosts.items()):
        known = known.pinned(name, f"10.0.{at >> 8}.{at & 255}", port, keys)

    again = parse(known.dump(), "x")

    assert again.dump() == known.dump()
    for at, (name, (keys, port)) in enumerate(hosts.items()):
        assert again.keys(name, "moved", 22) == keys
        assert again.keys("unnamed", f"10.0.{at >> 8}.{at & 255}", port) == keys


@given(st.text())
def test_no_text_is_a_crash(text: str) -> None:
    with suppress(OpenSshFileError):
        known = parse(text, "x")
        assert known.pinned("pi", "10.0.0.1", 22, (KEY,)).keys("pi", "10.0.0.1", 22)
    with suppress(OpenSshFileError):
        parse(f"pi {text}", "x")


@pytest.mark.parametrize("kind", ["ed25519", "ecdsa", "rsa"])
def test_fingerprints_are_those_of_openssh(tmp_path: Path, kind: str) -> None:
    if lacking := servers.missing():
        pytest.skip(f"needs {lacking}")
    key = servers.make_key(tmp_path / "key", kind)
    assert fingerprint(key) == keygen("-lf", tmp_path / "key.pub").split()[1]


@pytest.mark.parametrize(
    "text",
    [
        "",
        "ssh-ed25519",
        "ssh-ed25519 !!!",
        "ssh-ed25519 AAAA",
        f"ssh-rsa {KEY.split()[1]}",
        "ssh-rsa AAA",
        f"{KEY[:30]}!{KEY[30:]}",
    ],
)
def test_a_text_that_is_not_a_key_is_rejected(text: str) -> None:
    with pytest.raises(OpenSshFileError, match=r"^x:1: (a line needs|not a public key)"):
        parse(f"pi {text}", "x")


def test_the_file_stands_beside_the_spec(tmp_path: Path) -> None:
    assert path_beside(Path("lab/swarm.yaml")) == Path("lab/swarm.known_hosts")
    assert read(tmp_path / "absent.known_hosts").keys("pi", "10.0.0.1", 22) == ()


def test_pinning_replaces_what_was_pinned() -> None:
    known = KnownHosts().pinned("a", "10.0.0.1", 22, (KEY,)).pinned("b", "10.0.0.2", 22, (KEY,))
    known = known.pinned("a", "10.0.0.1", 22, (OTHER,))
    assert known.keys("a", "10.0.0.1", 22) == (OTHER,)
    assert known.keys("b", "10.0.0.2", 22) == (KEY,)
    assert known.keys("c", "10.0.0.3", 22) == ()


def test_two_hosts_behind_one_address_differ_by_port() -> None:
    known = KnownHosts().pinned("a", "10.0.0.1", 2201, (KEY,)).pinned("b", "10.0.0.1", 2202, (OTHER,))
    assert "a,[10.0.0.1]:2201 ssh-ed25519" in known.dump()
    assert known.keys("unnamed", "10.0.0.1", 2201) == (KEY,)
    assert known.keys("unnamed", "10.0.0.1", 2202) == (OTHER,)
    assert known.keys("unnamed", "10.0.0.1", 22) == ()


def test_the_name_in_the_spec_goes_before_the_address() -> None:
    """A key is not accepted from another host that took over the address."""
    known = parse(f"a,10.0.0.1 {KEY}\nb {OTHER}\n", "x")
    assert known.keys("b", "10.0.0.1", 22) == (OTHER,)
    moved = known.pinned("b", "10.0.0.1", 22, (OTHER,))
    assert moved.dump() == f"b,10.0.0.1 {OTHER}\na {KEY}\n"


def test_comments_markers_and_other_lines_stay_as_they_are() -> None:
    text = (
        f"# the hall\n\n@cert-authority *.lab {KEY} ours\n"
        f"@revoked * {OTHER}\ngate,10.0.0.9 {KEY} by hand \n*.hall {KEY}\n"
    )
    known = parse(text, "x")
    assert known.dump() == text
    assert known.pinned("pi", "10.0.0.1", 22, (KEY,)).dump() == f"{text}pi,10.0.0.1 {KEY}\n"
    changed = known.pinned("gate", "10.0.0.8", 22, (OTHER,)).dump()
    assert changed == text.replace(
        f"gate,10.0.0.9 {KEY} by hand ", f"gate,10.0.0.8 {OTHER}\n10.0.0.9 {KEY} by hand"
    )


def test_revoked_keys_and_patterns_are_honoured() -> None:
    known = parse(f"@revoked pi* {OTHER}\n*,!pi-9 {KEY}\n@cert-authority * {OTHER}\n", "x")
    assert known.revoked("pi-1", "10.0.0.1", 22) == (OTHER,)
    assert known.revoked("gate", "10.0.0.1", 22) == ()
    assert known.keys("pi-1", "10.0.0.1", 22) == (KEY,)
    assert known.keys("pi-9", "pi-9", 22) == ()


def test_several_keys_of_one_host_are_all_accepted() -> None:
    assert parse(f"pi {KEY}\npi {OTHER}\n", "x").keys("pi", "10.0.0.1", 22) == (KEY, OTHER)


@needs_ssh_keygen
def test_names_that_openssh_hashed_are_found_and_replaced(tmp_path: Path) -> None:
    path = tmp_path / "swarm.known_hosts"
    path.write_text(f"[192.168.77.11]:2222 {KEY}\n")
    keygen("-H", "-f", path)
    assert path.read_text().startswith("|1|")

    known = read(path)

    assert known.keys("pi", "192.168.77.11", 2222) == (KEY,)
    assert known.keys("pi", "192.168.77.11", 22) == ()
    assert known.keys("pi", "192.168.77.12", 2222) == ()
    replaced = known.pinned("pi", "192.168.77.11", 2222, (OTHER,))
    assert replaced.dump() == f"pi,[192.168.77.11]:2222 {OTHER}\n"


@needs_ssh_keygen
@pytest.mark.parametrize(
    ("address", "port", "pattern"),
    [
        ("192.168.77.11", 22, "192.168.77.11"),
        ("192.168.77.11", 2222, "[192.168.77.11]:2222"),
        ("fe80::1", 2222, "[fe80::1]:2222"),
        ("Pi.Local", 22, "pi.local"),
        ("192.168.77.11", 22, "pi"),
    ],
)
def test_ssh_keygen_finds_what_was_pinned(tmp_path: Path, address: str, port: int, pattern: str) -> None:
    path = tmp_path / "swarm.known_hosts"
    path.write_text(read(path).pinned("pi", address, port, (KEY,)).dump())
    assert KEY in keygen("-F", pattern, "-f", path)
    assert keygen("-F", "other", "-f", path) == ""


def test_ssh_accepts_a_host_by_this_file_and_no_other(sshd: Sshd, tmp_path: Path) -> None:
    def ssh(path: Path) -> subprocess.CompletedProcess[str]:
        options = {
            "UserKnownHostsFile": path,
            "GlobalKnownHostsFile": "/dev/null",
            "StrictHostKeyChecking": "yes",
        }
        return subprocess.run(
            [
                *("ssh", "-F", "/dev/null", "-i", sshd.identity, "-p", str(sshd.port)),
                *(word for key, value in options.items() for word in ("-o", f"{key}={value}")),
                *("root@127.0.0.1", "echo", "in"),
            ],
            capture_output=True,
            text=True,
            check=False,
            stdin=subprocess.DEVNULL,
        )  # fmt: skip

    good, stale, revoked = tmp_path / "good", tmp_path / "stale", tmp_path / "revoked"
    good.write_text(KnownHosts().pinned("pi", "127.0.0.1", sshd.port, sshd.keys).dump())
    other = servers.make_key(tmp_path / "k")
    stale.write_text(KnownHosts().pinned("pi", "127.0.0.1", sshd.port, (other,)).dump())
    revoked.write_text(good.read_text() + "".join(f"@revoked * {key}\n" for key in sshd.keys))

    assert ssh(good).stdout == "in\n"
    assert "Host key verification failed" in ssh(stale).stderr
    assert "revoked" in ssh(revoked).stderr.lower()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (f"@trusted pi {KEY}", "x:1: the marker @trusted is not known, only @cert-authority and @revoked"),
        ("# a\npi", "x:2: a line needs host names, a key type and a key"),
        ("pi x y", "x:1: not a public key: the text after x is not"),
        (f"pi ssh-rsa {KEY.split()[1]}", "x:1: not a public key: the text after ssh-rsa is not a key"),
        ("version: 1\nhosts: {}", "x:1: a line needs host names"),
    ],
)
def test_errors_name_the_line_and_the_reason(text: str, message: str) -> None:
    with pytest.raises(OpenSshFileError) as caught:
        parse(text, "x")
    assert str(caught.value).startswith(message)


def test_a_pipe_and_a_huge_file_are_errors(tmp_path: Path) -> None:
    (tmp_path / "big").write_bytes(b"#" * (1 << 21))
    for path, reason in (
        (tmp_path, "not a regular file"),
        (Path("/dev/zero"), "not a regular file"),
        (tmp_path / "big", "larger than 1 MiB"),
    ):
        with pytest.raises(OpenSshFileError, match=reason):
            read(path)


@needs_ssh_keygen
def test_wrong_lines_of_the_users_own_file_are_skipped(tmp_path: Path) -> None:
    path = tmp_path / "known_hosts"
    path.write_text(f"10.0.0.1 {KEY}\n")
    keygen("-H", "-f", path)
    hashed = path.read_text()
    assert hashed.startswith("|1|")
    path.write_text(f"10.0.0.1 1024 35 1234\n\n@odd x\n{hashed}[10.0.0.2]:2222 {OTHER}\n")

    known = read_valid_lines(path)

    assert known.find(["10.0.0.1"]) == (KEY,)
    assert known.find(["[10.0.0.2]:2222"]) == (OTHER,)
    assert known.find(["10.0.0.2"]) == ()
    assert read_valid_lines(tmp_path / "absent") == read_valid_lines(Path("/dev/null")) == KnownHosts(())


@pytest.mark.parametrize("hashed", ["|1|", "|1|AAAA|AAAA", "|1|!|!", "|2|a|b", "|1|AAAA"])
def test_a_wrong_hash_is_the_name_of_no_host(hashed: str) -> None:
    assert parse(f"{hashed} {KEY}", "x").keys("pi", "10.0.0.1", 22) == ()
