"""The loader of a firewall, with the real nft in a network namespace."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests import ROOT
from tests.render.test_firewall import NEEDED

pytestmark = NEEDED
SCRIPT = ROOT / "templates/os/load-firewall"
RULES = """
table inet swarm-new
delete table inet swarm-new
table inet swarm-new {{
  chain input {{
    type filter hook input priority filter; policy accept;
    tcp dport {} drop
  }}
}}
"""


class Namespace:
    def __init__(self, folder: Path) -> None:
        self.name, self.runtime, self._file = f"swarm-load-{os.getpid()}", folder, folder / "firewall.nft"
        subprocess.run(["ip", "netns", "add", self.name], check=True)

    def run(self, *argv: str | Path) -> subprocess.CompletedProcess[str]:
        environment = {"PATH": os.environ["PATH"], "RUNTIME_DIRECTORY": str(self.runtime)}
        return subprocess.run(
            ["ip", "netns", "exec", self.name, *argv], env=environment, capture_output=True, text=True,
            check=False,
        )  # fmt: skip

    def load(self, ports: str) -> subprocess.CompletedProcess[str]:
        self._file.write_text(RULES.format(ports), "utf-8")
        return self.run("sh", SCRIPT, self._file, "swarm-new")

    def listed(self) -> str:
        return self.run("nft", "-s", "list", "table", "inet", "swarm-new").stdout

    def kept(self) -> str:
        return (self.runtime / "table").read_text("utf-8")


@pytest.fixture
def namespace(tmp_path: Path) -> Iterator[Namespace]:
    made = Namespace(tmp_path)
    yield made
    subprocess.run(["ip", "netns", "del", made.name], check=True)


def test_a_table_replaces_the_one_before_and_no_other(namespace: Namespace) -> None:
    namespace.run("nft", "add table inet of-the-host")
    for port in ("11311", "11312"):
        done = namespace.load(port)
        assert done.returncode == 0, done.stderr
        assert f"tcp dport {port} drop" in namespace.listed()
        assert namespace.kept() == namespace.listed()
    assert "11311" not in namespace.listed()
    assert "table inet of-the-host" in namespace.run("nft", "list", "tables").stdout


def test_ephemeral_ports_are_those_of_the_kernel(namespace: Namespace) -> None:
    namespace.run("sysctl", "-qw", "net.ipv4.ip_local_port_range=20000 30000")
    assert namespace.load("$ephemeral").returncode == 0
    assert "tcp dport 20000-30000 drop" in namespace.listed()


def test_a_table_with_an_error_leaves_the_one_before(namespace: Namespace) -> None:
    namespace.load("11311")
    assert namespace.load("no-port").returncode != 0
    assert "tcp dport 11311 drop" in namespace.listed()
