"""The systems of hosts, as their agents know them: of those that answer, and what was requested."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from swarm_onboard.agent.hardware import UsbDevice

from swarmctl.deploy import host_systems
from swarmctl.deploy.host_systems import System, systems, with_hashes
from swarmctl.remote.parallel_hosts import Finished
from swarmctl.remote.transport import HostError, Kind, Session, Target
from swarmctl.swarm.resolved import Swarm
from tests.loading import load_swarm
from tests.onboard.agent.fakehost import FakeHost
from tests.seams.test_a_new_verb import Hosts

SPEC = """\
version: 1
name: new
mode: central
hub: a
hosts:
  a: {address: 192.0.2.1}
  b: {address: 192.0.2.2}
robots:
  koala: {type: koala, host: b}
  k3: {type: khepera3, host: a}
links:
  - {kind: wlan, name: lab, hosts: [a, b]}
  - {kind: serial, host: b, robot: koala, device: /dev/ttyS0}
  - {kind: serial, host: a, robot: k3, device: /dev/ttyS0}
"""
ADAPTER = UsbDevice("0403", "6001", "FT232R", "A1004xyz", ["/dev/ttyUSB0"])
KNOWN = System("debian-12", "3.11.2", "6.1.0 #1", "Pi", [ADAPTER], {}, {}, {})


@pytest.fixture
def swarm(tmp_path: Path) -> Swarm:
    (tmp_path / "swarm.yaml").write_text(SPEC)
    swarm, found = load_swarm(tmp_path / "swarm.yaml")
    assert swarm is not None, found
    return swarm


TARGETS = {name: Target(name, "192.0.2.1", "robot") for name in "ab"}


def test_each_host_that_answers_has_its_system(
    swarm: Swarm, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    host = FakeHost(tmp_path / "a")
    (host.prefix / "bin/sudo").write_text('#!/bin/sh\nshift\nexec "$@"\n')
    (host.prefix / "bin/sudo").chmod(0o755)
    (tmp_path / "a/etc/os-release").write_text('ID=debian\nVERSION_ID="12"\n')

    @contextmanager
    def connect(self: Hosts, target: Target) -> Iterator[Session]:
        if target.host == "b":
            raise HostError(Kind.UNREACHABLE, "no answer")
        with there(self, target) as session:
            yield session

    there = Hosts.connect
    monkeypatch.setattr(Hosts, "connect", connect)
    found = systems(swarm, TARGETS, Hosts({"a": host}), parallel=2)
    assert set(found) == {"a"}
    assert found["a"].platform == f"debian-12-{os.uname().machine}"
    assert re.fullmatch(r"3\.\d+\.\d+\S*", found["a"].python)
    assert found["a"].kernel.startswith(os.uname().release)


def test_what_was_not_requested_is_left_out(swarm: Swarm, monkeypatch: pytest.MonkeyPatch) -> None:
    many = dict.fromkeys(("k3", "koala", "\x1b[2J"), "1")
    hostile = KNOWN._replace(
        devices=[ADAPTER._replace(ports=["/dev/ttyUSB0"] * 5000)] * 5000,
        packages=many, ports=many, firmware=many,
    )  # fmt: skip
    monkeypatch.setattr(host_systems, "ask_each", lambda *_, **__: iter([Finished("b", hostile, 0.1)]))
    (found,) = systems(swarm, TARGETS, Hosts({}), parallel=2).values()
    assert (len(found.devices), len(found.devices[0].ports)) == (100, 100)
    assert (found.packages, found.ports, found.firmware) == ({}, {"koala": "1"}, {"koala": "1"})


def test_a_hash_stands_for_each_serial_number() -> None:
    hashed = with_hashes(KNOWN._replace(devices=[ADAPTER, ADAPTER._replace(serial="")]))
    assert [one.serial for one in hashed.devices] == ["sha256:98057965c4da037a", ""]
    assert hashed._replace(devices=KNOWN.devices) == KNOWN
