"""Participants of a DDS domain in a network namespace: what they may do, and what they receive."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from tests.child_process import child_process
from tests.render.dds_security.build import program
from tests.timing import wait_for

NEEDED = pytest.mark.skipif(
    os.geteuid() != 0 or shutil.which("ip", path="/usr/sbin:/usr/bin") is None, reason="needs root and ip"
)
UNSECURED = "-"
DOMAIN = 5


@contextmanager
def network() -> Iterator[str]:
    """Make a network namespace that nothing leaves, with multicast on its loopback; yields its name."""
    name = f"swarm-dds-{os.getpid()}"
    inside = ["ip", "-n", name]
    subprocess.run(["ip", "netns", "add", name], check=True)
    try:
        subprocess.run([*inside, "link", "set", "lo", "up", "multicast", "on"], check=True)
        subprocess.run([*inside, "route", "add", "224.0.0.0/4", "dev", "lo"], check=True)
        yield name
    finally:
        subprocess.run(["ip", "netns", "del", name], check=True)


@dataclass(frozen=True)
class Participant:
    """A running participant, and what it has printed."""

    process: subprocess.Popen[str]
    output: Path
    errors: Path

    def accepted(self) -> bool:
        """Return whether the security plugins took the files of its enclave."""
        return bool(wait_for(self._lines, complaint="it printed nothing")[0]["participant"])

    def created(self) -> dict[tuple[str, str], bool]:
        """Return whether each writer ("pub", topic) and reader ("sub", topic) was created."""
        assert self.accepted(), self.errors.read_text()
        wait_for(lambda: {"ready": True} in self._lines(), complaint="it did not get ready")
        found = [one for one in self._lines() if "created" in one]
        return {(kind, one[kind]): one["created"] for one in found for kind in ("pub", "sub") if kind in one}

    def received(self) -> set[str]:
        """Return the topics on which it has received a sample."""
        return {one["received"] for one in self._lines() if "received" in one}

    def receives(self, *topics: str) -> None:
        """Wait until it has received a sample on each topic."""
        wait_for(lambda: self.received() >= {*topics}, complaint=f"no sample on one of {topics}")

    def _lines(self) -> list[dict[str, Any]]:
        whole, _, _ = self.output.read_text().rpartition("\n")
        return [json.loads(line) for line in whole.splitlines()]


@contextmanager
def participant(
    implementation: str, namespace: str, folder: Path, enclave: Path | str, *endpoints: str
) -> Iterator[Participant]:
    """Run a participant with the files of ``enclave``; its endpoints are "pub TOPIC" and "sub TOPIC".

    What it prints is kept in ``folder``.
    """
    number = len([*folder.glob("*.out")])
    output, errors = (folder / f"{number}.{kind}" for kind in ("out", "err"))
    words = [word for one in endpoints for word in one.split()]
    argv = ["ip", "netns", "exec", namespace, program(implementation), str(DOMAIN), str(enclave), *words]
    with (
        output.open("w") as out,
        errors.open("w") as err,
        child_process(argv, stdin=subprocess.PIPE, stdout=out, stderr=err) as process,
    ):
        yield Participant(process, output, errors)
