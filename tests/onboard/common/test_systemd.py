"""What systemd receives of a node."""

from __future__ import annotations

import os
import resource
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from swarm_onboard.common.systemd import Notifier


@contextmanager
def without_descriptors() -> Iterator[None]:
    """No file and no socket can be opened, as in a flood of connections."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    lowest = os.dup(0)
    os.close(lowest)
    resource.setrlimit(resource.RLIMIT_NOFILE, (lowest, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def test_a_node_without_free_descriptors_still_sends_beats(tmp_path: Path) -> None:
    path = str(tmp_path / "notify")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(path)
        systemd.settimeout(5)
        notifier = Notifier({"NOTIFY_SOCKET": path, "WATCHDOG_USEC": "1000000"})
        with without_descriptors():
            notifier.beat()
        assert systemd.recv(100) == b"WATCHDOG=1"


def test_a_status_has_an_error_number_until_it_is_none(tmp_path: Path) -> None:
    path = str(tmp_path / "notify")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(path)
        systemd.settimeout(5)
        notifier = Notifier({"NOTIFY_SOCKET": path})
        for text, error, sent in (
            ("connects", False, b"STATUS=connects"),
            ("the device\nis missing", True, b"STATUS=the device is missing\nERRNO=5"),
            ("drives", False, b"STATUS=drives\nERRNO=0"),
        ):
            notifier.status(text, error=error)
            assert systemd.recv(100) == sent


def test_a_node_without_systemd_sends_nothing() -> None:
    Notifier({}).beat()
