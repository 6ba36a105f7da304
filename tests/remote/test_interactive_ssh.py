"""``swarmctl ssh``: the program ``ssh`` with the way and the keys of the spec, by its own files alone."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from swarmctl.remote import known_hosts
from swarmctl.remote.known_hosts import KnownHosts
from tests.remote import sshd as servers
from tests.remote.sshd import Sshd
from tests.timing import PATIENCE

SPEC = """\
version: 1
name: lab
defaults: {{host: {{user: root}}}}
hosts:
  pi: {{address: 127.0.0.1, port: {pi}, via: gate}}
  gate: {{address: 127.0.0.1, port: {gate}}}
"""


@pytest.fixture
def folder(tmp_path: Path, sshd: Sshd, spare: Path) -> Iterator[Path]:
    """A spec in a folder with a blank and a percent sign, of a host behind another."""
    folder = tmp_path / "a 100% lab"
    (folder / "home/.ssh").mkdir(parents=True)
    (folder / "home/.ssh/config").write_text(f"IdentityFile {sshd.identity}\n")
    with servers.running(spare) as pi:
        (pi.folder / "authorized").write_text(sshd.identity.with_suffix(".pub").read_text())
        (folder / "swarm.yaml").write_text(SPEC.format(pi=pi.port, gate=sshd.port))
        pinned = KnownHosts().pinned("pi", "127.0.0.1", pi.port, pi.keys)
        pinned = pinned.pinned("gate", "127.0.0.1", sshd.port, sshd.keys)
        known_hosts.path_beside(folder / "swarm.yaml").write_text(pinned.dump())
        yield folder


def ssh(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    env = {**os.environ, "HOME": str(folder / "home")}
    return subprocess.run(
        (sys.executable, "-m", "swarmctl", "ssh", *words),
        cwd=folder, env=env, capture_output=True, text=True, check=False, timeout=PATIENCE,
        stdin=subprocess.DEVNULL,
    )  # fmt: skip


def test_a_command_behind_a_jump_host(folder: Path) -> None:
    done = ssh(folder, "pi", "--", "echo out; echo err >&2; exit 7")
    assert (done.returncode, done.stdout, done.stderr) == (7, "out\n", "err\n")
    assert ssh(folder, "swarm.yaml", "pi", "--", "printf", "%s;", "a  b", "$HOME").stdout == "a  b;$HOME;"


def test_another_key_than_the_pinned_one_is_refused(folder: Path) -> None:
    path = known_hosts.path_beside(folder / "swarm.yaml")
    lines = path.read_text().splitlines()
    gate = next(one.split()[1:] for one in lines if one.startswith("gate"))
    path.write_text("".join(f"{one.split()[0]} {' '.join(gate)}\n" for one in lines if one[0] != "#"))
    done = ssh(folder, "pi", "--", "echo in")
    assert (done.returncode, done.stdout) == (255, "")
    assert "REMOTE HOST IDENTIFICATION HAS CHANGED" in done.stderr


def test_a_host_without_a_pinned_key_is_not_connected_to(folder: Path) -> None:
    path = known_hosts.path_beside(folder / "swarm.yaml")
    path.write_text("".join(one for one in path.read_text().splitlines(True) if not one.startswith("gate")))
    done = ssh(folder, "pi")
    assert done.returncode == 1
    assert "gate (127.0.0.1) has no pinned key" in done.stderr
    assert "`swarmctl trust` shows the keys of new hosts" in done.stderr
