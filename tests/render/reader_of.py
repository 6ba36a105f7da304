"""Real ROS that reads what is rendered, for the tests of a session; without a lab they are skipped."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

from swarmctl.lab.errors import LabError
from swarmctl.lab.hosts import image, processes


class Reader:
    """A host with real ROS, which reads one file after the other."""

    def __init__(self, disk: Path, distro: str) -> None:
        script = Path(__file__).with_name("parameter_host.py")
        argv = ("unshare", "--net", *processes.isolated((sys.executable, str(script), str(disk), distro)))
        self.distro = distro
        self.process = subprocess.Popen(
            argv, env=processes.environment(), stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL, text=True,
        )  # fmt: skip

    def read(self, files: str | Mapping[str, str]) -> Mapping[str, Any]:
        """Returns what a node gets of a file, or of several by their paths: values by name, or an error."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(json.dumps(files) + "\n")
        self.process.stdin.flush()
        answer: Mapping[str, Any] = json.loads(self.process.stdout.readline())
        return answer


def reader_of(distro: str) -> Iterator[Reader]:
    try:
        processes.require("unshare", "ip", "mount", "mmdebstrap")
        disk = image.ensure(lambda _line: None, distro=distro)
    except LabError as error:
        pytest.skip(f"no lab here: {error}")
    reader = Reader(disk, distro)
    with reader.process:
        yield reader
        reader.process.kill()
