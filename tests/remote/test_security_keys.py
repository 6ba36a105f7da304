"""A security key (FIDO) that somebody must touch: a real ssh with a key that is a program."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from swarmctl.remote import openssh
from swarmctl.remote.openssh import OpenSshTransport
from swarmctl.remote.transport import HostError, Kind
from tests import ROOT
from tests.remote import sshd as servers
from tests.remote.sshd import Sshd
from tests.timing import PATIENCE

SOURCES = ROOT / "tests/remote"


@pytest.fixture
def key(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The private half of a security key, which is on no disk; what is there names it."""
    if lacking := [one for one in ("ssh-keygen", "gcc") if not shutil.which(one)]:
        pytest.skip(f"needs {', '.join(lacking)}")
    library = tmp_path / "security_key.so"
    source = SOURCES / "security_key.c"
    subprocess.run(["gcc", "-shared", "-fPIC", "-o", str(library), str(source)], check=True)
    monkeypatch.setenv("SWARM_SECURITY_KEY", f"{sys.executable} {SOURCES}/security_key.py")
    monkeypatch.setenv("SWARM_TOUCHED", str(tmp_path / "touched"))
    (tmp_path / "ssh").mkdir()
    (tmp_path / "ssh/config").write_text(f"SecurityKeyProvider {library}\n")
    path = tmp_path / "ssh/id_ed25519_sk"
    command = ["ssh-keygen", "-q", "-t", "ed25519-sk", "-w", str(library), "-N", "", "-f", str(path)]
    made = subprocess.run(command, capture_output=True, text=True, check=False, env=os.environ)
    assert made.returncode == 0, made.stderr
    return path


@pytest.fixture
def host(key: Path, spare: Path) -> Iterator[Sshd]:
    with servers.running(spare, authorize=False) as running:
        (running.folder / "authorized").write_text(key.with_name("id_ed25519_sk.pub").read_text())
        yield running


def test_the_operator_is_asked_to_touch_the_key(key: Path, host: Sshd, tmp_path: Path) -> None:
    noted = threading.Event()
    notes: list[str] = []

    def note(text: str) -> None:
        notes.append(text)
        noted.set()

    def touch() -> None:
        noted.wait(PATIENCE)
        (tmp_path / "touched").touch()

    finger = threading.Thread(target=touch)
    finger.start()
    with OpenSshTransport(key.parent, use_agent=False, note=note).connect(
        host.target(identities=(key,))
    ) as session:
        assert servers.run(session, "echo in").stdout == b"in\n"
    finger.join()
    assert notes == ["touch the security key to log in to pi"]


def test_a_key_that_nobody_touches_is_named(
    key: Path, host: Sshd, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(openssh, "_TOUCH", 0.3)
    transport = OpenSshTransport(key.parent, use_agent=False)
    with pytest.raises(HostError) as caught, transport.connect(host.target(identities=(key,))):
        pass
    (tmp_path / "touched").touch()  # what waits for it ends
    assert caught.value.kind is Kind.AUTH
    assert re.fullmatch(
        r"nobody touched the security key within 0\.3\d* s to log in to pi", caught.value.message
    )
