"""What Mitogen runs on a host."""

from __future__ import annotations

import subprocess


def unpack(folder: str, payload: bytes) -> None:
    """Unpacks a tar.gz into ``folder`` and restarts the service; does nothing without a payload."""
    if payload:
        command = f"tar xz -C {folder} && systemctl restart -- bench.service"
        subprocess.run(["/bin/sh", "-c", command], input=payload, check=True)
