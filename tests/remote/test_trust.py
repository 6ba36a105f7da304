"""``swarmctl trust``: nothing is pinned that nobody looked at, and a changed key never slips in."""

from __future__ import annotations

import base64
import os
import pty
import select
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from swarmctl.remote.known_hosts import KnownHosts, fingerprint, read
from tests import in_process
from tests.ports import free_port
from tests.remote import sshd as servers
from tests.remote.sshd import Sshd
from tests.timing import PATIENCE

RUN = "import sys, typer; from swarmctl.cli.verbs.trust import trust; typer.run(trust)"


@pytest.fixture
def home(tmp_path: Path) -> Path:
    """A home with an ssh configuration that leads the spec's address to loopback."""
    (tmp_path / "home/.ssh").mkdir(parents=True)
    return tmp_path / "home"


@pytest.fixture
def spec(tmp_path: Path, sshd: Sshd, home: Path) -> Path:
    path = tmp_path / "swarm.yaml"
    path.write_text(
        "version: 1\nname: new\nmode: leader\nleader: laptop\n"
        "hosts:\n"
        f"  laptop: {{address: 127.0.0.1, user: root, port: {sshd.port}}}\n"
        "robots:\n  koala: {type: koala, host: laptop}\n"
        "links:\n"
        "  - {kind: serial, host: laptop, robot: koala, usb: {serial: A6}}\n"
        "control:\n  - {by: laptop, of: [koala]}\n"
    )
    return path


def trust(spec: Path, home: Path, *options: str) -> subprocess.CompletedProcess[str]:
    return in_process.swarmctl("trust", str(spec), *options, env={"HOME": str(home), "NO_COLOR": "1"})


def file(spec: Path) -> Path:
    return spec.with_name("swarm.known_hosts")


def pin(spec: Path, host: str, port: int, key: str) -> None:
    file(spec).write_text(KnownHosts().pinned(host, "127.0.0.1", port, (key,)).dump())


def pinned(spec: Path) -> dict[str, tuple[str, ...]]:
    """The pinned keys by host name."""
    found: dict[str, tuple[str, ...]] = {}
    for line in read(file(spec)).lines:
        if line.names:
            found[line.names[0]] = (*found.get(line.names[0], ()), line.key)
    return found


def test_without_a_terminal_nothing_is_pinned(spec: Path, home: Path, sshd: Sshd) -> None:
    done = trust(spec, home)

    assert done.returncode == 1
    assert fingerprint(sshd.keys[2]) in done.stdout
    assert "no terminal to ask on" in done.stderr
    assert "--yes" in done.stderr
    assert pinned(spec) == {}


def test_yes_pins_and_a_second_time_finds_nothing_new(spec: Path, home: Path, sshd: Sshd) -> None:
    first = trust(spec, home, "--yes")
    assert (first.returncode, pinned(spec)) == (0, {"laptop": (sshd.keys[2],)}), first.stderr
    before = file(spec).stat().st_mtime_ns

    second = trust(spec, home)

    assert second.returncode == 0, second.stderr
    assert second.stdout.startswith("known ")
    assert file(spec).stat().st_mtime_ns == before


def test_a_changed_key_is_pinned_only_with_replace(spec: Path, home: Path, sshd: Sshd) -> None:
    stale = servers.make_key(spec.parent / "stale")
    pin(spec, "laptop", sshd.port, stale)

    refused = trust(spec, home, "--yes")

    assert refused.returncode == 1
    assert fingerprint(stale) in refused.stdout
    assert fingerprint(sshd.keys[2]) in refused.stdout
    assert "--host laptop --replace" in refused.stderr
    assert pinned(spec) == {"laptop": (stale,)}

    assert trust(spec, home, "--host", "laptop", "--replace", "--yes").returncode == 0
    assert pinned(spec) == {"laptop": (sshd.keys[2],)}


def test_an_unknown_host_and_an_absent_one(spec: Path, home: Path) -> None:
    unknown = trust(spec, home, "--host", "nobody")
    assert unknown.returncode == 1
    assert "no host or robot called `nobody`" in unknown.stderr

    (home / ".ssh/config").write_text(
        f"Host laptop\n HostName 127.0.0.1\n ProxyJump 127.0.0.1:{free_port()}\n"
    )
    absent = trust(spec, home, "--yes")
    assert absent.returncode == 4
    assert "nothing listens for SSH there" in absent.stderr


@pytest.fixture
def fleet(tmp_path: Path, home: Path, sshd: Sshd) -> Path:
    """A spec of five hosts that are there, and of forty on which nothing listens."""
    (home / ".ssh/config").write_text("Host tb-* off-*\n HostName 127.0.0.1\n")
    path = tmp_path / "swarm.yaml"
    path.write_text(
        "version: 1\nname: fleet\nmode: central\nhub: tb-1\nhosts:\n"
        f"  tb-[1-5]: {{address: '10.9.0.[1-5]', user: root, port: {sshd.port}}}\n"
        f"  off-[01-40]: {{address: '10.9.0.[11-50]', user: root, port: {free_port()}}}\n"
        "robots:\n  koala: {type: koala, host: tb-1}\n"
        "links:\n  - {kind: serial, host: tb-1, robot: koala, usb: {serial: A6}}\n"
        "  - {kind: wlan, name: lab, hosts: ['host:*'], multicast: false}\n"
    )
    return path


def test_many_hosts_of_one_kind_share_a_line(fleet: Path, home: Path, sshd: Sshd) -> None:
    first = trust(fleet, home, "--yes")
    assert first.stdout.count(fingerprint(sshd.keys[2])) == 5  # a person compares each new key
    assert first.returncode == 4
    assert first.stderr.count("nothing listens for SSH there") == 1
    assert first.stderr.startswith("off-[01-40]  unreachable: ")
    assert first.stderr.count("help: ") == 1

    second = trust(fleet, home, "--host", "tb-[1-5]")
    assert second.stdout == "known    5 hosts: tb-[1-5]\n"
    assert trust(fleet, home, "--host", "tb-[1-2]").stdout.count(fingerprint(sshd.keys[2])) == 2


def test_a_command_replaces_many_changed_keys(fleet: Path, home: Path, sshd: Sshd) -> None:
    stale = servers.make_key(fleet.parent / "stale")
    known = KnownHosts()
    for n in range(1, 6):
        known = known.pinned(f"tb-{n}", "127.0.0.1", sshd.port, (stale,))
    file(fleet).write_text(known.dump())
    refused = trust(fleet, home, "--host", "tb-*")
    assert "add --host 'tb-[1-5]' --replace" in refused.stderr
    assert trust(fleet, home, "--host", "tb-[1-5]", "--replace", "--yes").returncode == 0
    assert set(pinned(fleet).values()) == {(sshd.keys[2],)}


def test_a_wrong_known_hosts_file_is_an_error_with_its_place(spec: Path, home: Path) -> None:
    file(spec).write_text("# ours\nlaptop\n")
    done = trust(spec, home)
    assert done.returncode == 1
    assert "swarm.known_hosts:2: a line needs host names, a key type and a key" in done.stderr


def test_a_wrong_ssh_config_is_an_error_with_its_place(spec: Path, home: Path) -> None:
    (home / ".ssh/config").write_text("Host *\n Port many\n")
    done = trust(spec, home)
    assert done.returncode == 1
    assert "config:2: Port many is not a number" in done.stderr


def test_bytes_and_lines_of_the_users_own_stay(spec: Path, home: Path, sshd: Sshd) -> None:
    file(spec).write_bytes(b"# H\xe4lle\n")
    assert trust(spec, home, "--yes").returncode == 0
    fresh = f"laptop,[127.0.0.1]:{sshd.port} {sshd.keys[2]}\n"
    assert file(spec).read_bytes() == b"# H\xe4lle\n" + fresh.encode()


@pytest.mark.parametrize("index", [0, 1, 2], ids=["rsa", "ecdsa", "ed25519"])
def test_a_pinned_key_of_any_type_is_known(spec: Path, home: Path, sshd: Sshd, index: int) -> None:
    pin(spec, "laptop", sshd.port, sshd.keys[index])
    done = trust(spec, home)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("known ")


def test_yes_pins_no_key_that_the_users_known_hosts_contradicts(spec: Path, home: Path, sshd: Sshd) -> None:
    stale, own = servers.make_key(spec.parent / "stale"), home / ".ssh/known_hosts"
    own.write_text(f"[127.0.0.1]:{sshd.port} {stale}\nbroken\n")

    refused = trust(spec, home, "--yes")

    assert refused.returncode == 1
    assert refused.stdout.startswith("changed ")
    assert f"in ~/.ssh/known_hosts: ssh-ed25519 {fingerprint(stale)}" in refused.stdout
    assert fingerprint(sshd.keys[2]) in refused.stdout
    assert "--host laptop --replace" in refused.stderr
    assert not file(spec).exists()

    assert trust(spec, home, "--host", "laptop", "--replace", "--yes").returncode == 0
    assert pinned(spec) == {"laptop": (sshd.keys[2],)}
    assert trust(spec, home).returncode == 0, "the swarm's own file goes before the user's"


@pytest.mark.parametrize("index", [0, 1, 2], ids=["rsa", "ecdsa", "ed25519"])
def test_yes_pins_the_key_that_the_users_known_hosts_has(
    spec: Path, home: Path, sshd: Sshd, index: int
) -> None:
    """The host shows a key of that type, though it has others, too."""
    (home / ".ssh/known_hosts").write_text(f"[127.0.0.1]:{sshd.port} {sshd.keys[index]}\n")
    done = trust(spec, home, "--yes")
    assert (done.returncode, pinned(spec)) == (0, {"laptop": (sshd.keys[index],)}), done.stderr


def test_a_key_that_the_users_known_hosts_revokes_is_never_pinned(spec: Path, home: Path, sshd: Sshd) -> None:
    (home / ".ssh/known_hosts").write_text("".join(f"@revoked * {key}\n" for key in sshd.keys))
    done = trust(spec, home, "--yes", "--replace")
    assert done.returncode == 1
    assert "revoked (@revoked)" in done.stderr
    assert not file(spec).exists()


def test_an_unreadable_known_hosts_of_the_user_is_a_warning(spec: Path, home: Path, sshd: Sshd) -> None:
    (home / ".ssh/known_hosts").write_bytes(b"#" * (1 << 21))
    done = trust(spec, home, "--yes")
    assert done.returncode == 0, done.stderr
    assert "known_hosts: larger than 1 MiB; new keys are not compared with it" in done.stderr
    assert pinned(spec) == {"laptop": (sshd.keys[2],)}


@pytest.mark.parametrize("greeting", [b"SSH-2.0-\x1b]0;owned\x07\r\n", b"SSH-\x1b[2J-gone\r\n", b"\x1b[2J\n"])
def test_no_escape_sequence_of_a_stranger_reaches_the_terminal(
    spec: Path, home: Path, greeting: bytes
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as stranger:
        threading.Thread(target=_greet, args=(stranger, greeting), daemon=True).start()
        (home / ".ssh/config").write_text(
            f"Host laptop\n ProxyJump root@127.0.0.1:{stranger.getsockname()[1]}\n"
        )
        done = trust(spec, home, "--yes")
    assert done.returncode == 4
    assert "127.0.0.1" in done.stderr
    assert not set(done.stdout + done.stderr) & {"\x1b", "\x07"}


def _greet(server: socket.socket, greeting: bytes) -> None:
    with suppress(OSError):
        while True:
            connection, _ = server.accept()
            with connection:
                connection.sendall(greeting)


def test_no_escape_sequence_of_a_file_reaches_the_terminal(spec: Path, home: Path, sshd: Sshd) -> None:
    """The file can come from somebody else's repository; a key's type can be any text."""
    kind = b"ssh-\x1b[2J"
    raw = base64.b64encode(len(kind).to_bytes(4, "big") + kind).decode()
    file(spec).write_text(f"laptop {kind.decode()} {raw}\n")
    done = trust(spec, home, "--yes")
    assert done.returncode == 1
    assert "was pinned: ssh-\\x1b[2J SHA256:" in done.stdout
    assert "\x1b" not in done.stdout + done.stderr


def test_a_revoked_key_is_never_pinned(spec: Path, home: Path, sshd: Sshd) -> None:
    revoked = "".join(f"@revoked * {key}\n" for key in sshd.keys)
    file(spec).write_text(revoked)
    done = trust(spec, home, "--yes", "--replace")
    assert done.returncode == 1
    assert done.stdout.startswith("revoked ")
    assert "revoked (@revoked)" in done.stderr
    assert file(spec).read_text() == revoked


def test_replace_with_host_leaves_a_changed_jump_host(
    spec: Path, home: Path, sshd: Sshd, tmp_path: Path
) -> None:
    stale = servers.make_key(tmp_path / "stale")
    with servers.running(tmp_path / "gate") as gate:
        (home / ".ssh/config").write_text(
            f"Host laptop\n ProxyJump root@gate\nHost gate\n HostName 127.0.0.1\n Port {gate.port}\n"
            f" IdentityFile {gate.identity}\n"
        )
        pin(spec, "gate", gate.port, stale)

        refused = trust(spec, home, "--host", "laptop", "--replace", "--yes")
        assert refused.returncode == 1
        assert pinned(spec) == {"gate": (stale,)}
        assert "--host gate --replace" in refused.stderr

        assert trust(spec, home, "--host", "gate", "--replace", "--yes").returncode == 0
        assert pinned(spec) == {"gate": (gate.keys[0],)}


def test_a_host_behind_another_is_seen_through_it(spec: Path, home: Path, sshd: Sshd, tmp_path: Path) -> None:
    with servers.running(tmp_path / "gate") as gate:
        (home / ".ssh/config").write_text(
            f"Host laptop\n ProxyJump root@gate\nHost gate\n HostName 127.0.0.1\n Port {gate.port}\n"
            f" IdentityFile {gate.identity}\n"
        )
        done = trust(spec, home, "--yes")
    assert done.returncode == 0, done.stderr
    assert pinned(spec) == {"gate": (gate.keys[0],), "laptop": (sshd.keys[2],)}


@pytest.fixture
def terminal(spec: Path, home: Path) -> Iterator[tuple[int, int]]:
    """``trust`` on a terminal of its own: process id and the terminal's other end."""
    pid, master = pty.fork()
    if pid == 0:
        os.environ["HOME"] = str(home)
        os.execv(sys.executable, [sys.executable, "-c", RUN, str(spec)])
    yield pid, master
    with suppress(ProcessLookupError):
        os.kill(pid, signal.SIGKILL)
    os.close(master)


def _answer(terminal: tuple[int, int], answer: str) -> int:
    """Wait for the question, answer it, and return the exit code."""
    pid, master = terminal
    seen = b""
    while b": " not in seen.partition(b"type yes to pin 1 key")[2]:
        assert select.select([master], [], [], PATIENCE)[0], seen
        seen += os.read(master, 4096)
    os.write(master, answer.encode() + b"\n")
    while select.select([master], [], [], PATIENCE)[0]:
        try:
            if not os.read(master, 4096):
                break
        except OSError:  # how Linux reports that the other end of a terminal is closed
            break
    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])


@pytest.mark.parametrize(("answer", "status"), [("yes", 0), ("y", 1), ("", 1)])
def test_on_a_terminal_it_asks_and_takes_only_the_whole_word(
    terminal: tuple[int, int], spec: Path, answer: str, status: int
) -> None:
    assert _answer(terminal, answer) == status
    assert bool(pinned(spec)) is (status == 0)
