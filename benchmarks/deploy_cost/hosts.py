"""Hosts that cost little: an sshd each on loopback, a folder for /opt and /etc, a stub of systemctl."""

from __future__ import annotations

import socket
import subprocess
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from tests.onboard.agent.fakehost import FakeHost
from tests.ports import free_port
from tests.remote import sshd

_WAIT = 20.0  # s until an sshd listens


@dataclass(frozen=True)
class SmallHost:
    """One of them. ``prefix`` is its root, ``app`` a folder for files that other tools write."""

    name: str
    port: int
    key: str
    identity: str
    prefix: str
    app: str

    def to_json(self) -> dict[str, Any]:
        """Returns it for the scripts of the tools."""
        return asdict(self)


@contextmanager
def running(folder: Path, number: int) -> Iterator[Sequence[SmallHost]]:
    """Starts so many hosts in ``folder``; their processes are gone afterwards."""
    Path("/run/sshd").mkdir(exist_ok=True)
    identity = folder / "id"
    public = sshd.make_key(identity)
    (folder / "authorized").write_text(f"{public}\n")
    servers: list[subprocess.Popen[bytes]] = []
    try:
        hosts = []
        for index in range(number):
            host = FakeHost(folder / f"h{index}")
            (host.prefix / "app").mkdir()
            (host.prefix / "home").mkdir()
            key = sshd.make_key(host.prefix / "key")
            port = free_port()
            (host.prefix / "sshd").write_text(_CONFIG.format(prefix=host.prefix, folder=folder, port=port))
            servers.append(subprocess.Popen([sshd.SSHD, "-D", "-f", str(host.prefix / "sshd")]))
            app = str(host.prefix / "app")
            hosts.append(SmallHost(f"h{index}", port, key, str(identity), str(host.prefix), app))
        for one in hosts:
            _wait_for(one.port)
        yield hosts
    finally:
        for server in servers:
            server.terminate()
        for server in servers:
            server.wait()


_CONFIG = """\
Port {port}
ListenAddress 127.0.0.1
HostKey {prefix}/key
AuthorizedKeysFile {folder}/authorized
PidFile none
PasswordAuthentication no
PermitRootLogin yes
StrictModes no
UsePAM no
Subsystem sftp internal-sftp
SetEnv SWARM_PREFIX={prefix} PATH={prefix}/bin:/usr/sbin:/usr/bin:/sbin:/bin HOME={prefix}/home
"""


def _wait_for(port: int) -> None:
    end = time.monotonic() + _WAIT
    while True:
        with socket.socket() as probe:
            if probe.connect_ex(("127.0.0.1", port)) == 0:
                return
        if time.monotonic() > end:
            raise SystemExit(f"no sshd listens at port {port}")
        time.sleep(0.05)
