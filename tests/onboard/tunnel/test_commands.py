"""The commands that make WireGuard on a host, with stand-ins for `ip` and `wg`; `lo` is the interface."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from swarm_onboard.tunnel.keys import Keys, line
from swarm_onboard.tunnel.peers import config

from swarmctl.resources import onboard
from tests.child_process import child_process
from tests.timing import PATIENCE, wait_for

PROGRAM = onboard() / "nodes/tunnel/tunnel.py"
KEY = "qB5GZoKc1dU5V0y1Fq6ZbGy2n3nYv8y0m8oQ0nJbLWU="
PEERS = {"port": 51820, "peers": [{"name": "k3-pi", "addresses": ["10.9.0.2"], "endpoint": "192.168.7.2"}]}
CONFIG = config(Keys(line("k3-pi", KEY)), PEERS, set())
# Fails where a file says so: `fails-ip-link-add` holds what it prints.
STAND_IN = """#!/bin/sh
name=${0##*/}; cd "${0%/*}/.."
echo "$name $*" >> calls
case "$*" in *" /dev/stdin") /bin/cat > given ;; *-handshakes) /bin/cat times ;; esac
[ ! -e "fails-$name-$1-$2" ] && [ ! -e "fails-$name-$1" ] || { /bin/cat fails-$name-$1* >&2; exit 1; }
echo "$name $*" >> done
"""


class Bench:
    """A folder with stand-ins, the key and the peers; and a socket in place of systemd's."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        (folder / "bin").mkdir()
        for name in ("ip", "wg"):
            (folder / "bin" / name).write_text(STAND_IN)
            (folder / "bin" / name).chmod(0o755)
        (folder / "key").write_text(f"{KEY}\n")
        (folder / "peers").write_text(json.dumps(PEERS))
        (folder / "keys").write_text(line("k3-pi", KEY))
        (folder / "times").write_text(f"{KEY} 0\n")
        self.notes = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.notes.bind(str(folder / "notify"))
        self.notes.settimeout(PATIENCE)

    @property
    def calls(self) -> list[str]:
        return (self.folder / "calls").read_text().splitlines()

    @contextmanager
    def running(self) -> Iterator[subprocess.Popen[str]]:
        environment = {
            "PATH": str(self.folder / "bin"), "PYTHONPATH": str(onboard().parent), "NOTIFY_SOCKET":
            str(self.folder / "notify"), "WATCHDOG_USEC": "30000", "PYTHONDONTWRITEBYTECODE": "1",
        }  # fmt: skip
        files = [word for name in ("peers", "keys", "key") for word in (f"--{name}", str(self.folder / name))]
        argv = [sys.executable, str(PROGRAM), "--interface", "lo", "--address", "10.9.0.1/16", *files]
        with child_process(argv, env=environment, stderr=subprocess.PIPE) as process:
            yield process

    def printed(self) -> str:
        """What the program prints when it fails at once."""
        with self.running() as process:
            _, text = process.communicate(timeout=PATIENCE)
        assert process.returncode == 1
        return text

    def wait_for_note(self, start: str) -> None:
        while not self.notes.recv(4096).decode().startswith(start):
            pass


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    made = Bench(tmp_path)
    yield made
    made.notes.close()


def test_the_key_reaches_wg_by_standard_input_alone(bench: Bench) -> None:
    with bench.running() as process:
        for note in ("READY=1", "STATUS=0 of 1 peers with a handshake", "WATCHDOG=1"):
            bench.wait_for_note(note)
        process.terminate()
        _, printed = process.communicate(timeout=PATIENCE)
    assert (process.returncode, printed) == (0, "")
    assert [one for one in bench.calls if "latest-handshakes" not in one] == [
        "ip link delete dev lo",
        "ip link add dev lo type wireguard",
        "wg setconf lo /dev/stdin",
        "ip address replace 10.9.0.1/16 dev lo",
        "ip link set dev lo mtu 1280 up",
        "ip link delete dev lo",
    ]
    assert (bench.folder / "given").read_text() == f"[Interface]\nPrivateKey = {KEY}\n{CONFIG}"


@pytest.mark.parametrize("damaged", ["", KEY[:-1], KEY + "x", KEY[:-2] + "V=", f"{KEY}\n{KEY}"])
def test_a_damaged_key_is_named_and_not_printed(bench: Bench, damaged: str) -> None:
    (bench.folder / "key").write_text(damaged)
    assert bench.printed() == f"{bench.folder}/key has no key of WireGuard\n"
    assert not (bench.folder / "given").exists()


def test_a_program_that_is_missing_is_named(bench: Bench) -> None:
    (bench.folder / "fails-ip-link-add").write_text("Error: Unknown device type.\n")
    assert bench.printed() == (
        "the kernel makes no WireGuard interface (Error: Unknown device type.), and there is no "
        "`wireguard-go`: load the module `wireguard`, or install wireguard-go\n"
    )
    (bench.folder / "bin/wg").unlink()
    assert bench.printed() == "there is no `wg`: install wireguard-tools\n"


def test_refused_peers_are_named_once_and_tried_again(bench: Bench) -> None:
    with bench.running() as process:
        bench.wait_for_note("READY=1")
        (bench.folder / "fails-wg-syncconf").write_text("busy\n")
        (bench.folder / "new").write_text(json.dumps({**PEERS, "port": 51821}))
        (bench.folder / "new").replace(bench.folder / "peers")
        wait_for(lambda: bench.calls.count("wg syncconf lo /dev/stdin") > 1)
        (bench.folder / "fails-wg-syncconf").unlink()
        wait_for(lambda: "wg syncconf" in (bench.folder / "done").read_text())
        process.terminate()
        _, printed = process.communicate(timeout=PATIENCE)
    assert printed == "busy; the peers stay as they were\n"
    assert "ListenPort = 51821\n" in (bench.folder / "given").read_text()


def test_it_ends_when_what_runs_the_interface_ends(bench: Bench) -> None:
    go = bench.folder / "bin/wireguard-go"
    go.write_text('#!/bin/sh\nread -r _ < "${0%/*}/../end"; exit 7\n')
    go.chmod(0o755)
    os.mkfifo(bench.folder / "end")
    (bench.folder / "fails-ip-link-add").touch()
    with bench.running() as process:
        bench.wait_for_note("READY=1")
        (bench.folder / "end").write_text("\n")
        _, printed = process.communicate(timeout=PATIENCE)
    assert (process.returncode, printed) == (1, "wireguard-go has ended with status 7\n")
