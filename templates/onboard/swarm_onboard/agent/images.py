"""What the engine of a container has of its image: whether it is there, and for which machine it is built."""

from __future__ import annotations

import os
import subprocess

from .clip import clipped
from .named_tuple import NamedTuple

_TIMEOUT = 10.0  # s
_UNKNOWN = ("image not known", "no such image")  # as podman and docker write it


class Image(NamedTuple):
    """What an engine has of an image. ``built_for``: its architecture, as Go names it; ``machine``: the
    host's; ``error``: why nothing is known.
    """

    there: bool
    built_for: str
    machine: str
    error: str


def look(engine: str, image: str) -> Image:
    """Returns what ``engine`` has of an image, which is named by its digest."""
    found = Image(False, "", os.uname().machine, "")
    command = [engine, "image", "inspect", "--format", "{{.Architecture}}", image]
    try:
        done = subprocess.run(
            command, stdin=subprocess.DEVNULL, capture_output=True, timeout=_TIMEOUT, check=False
        )
    except subprocess.TimeoutExpired:
        return found._replace(error=f"{engine} did not answer within {_TIMEOUT:g} s")
    except OSError as error:
        return found._replace(error=f"{engine} cannot be run: {error.strerror}")
    if done.returncode == 0:
        return found._replace(
            there=True, built_for=clipped(done.stdout.decode("utf-8", "replace").strip(), 40)
        )
    complaint = " ".join(done.stderr.decode("utf-8", "replace").split())
    if any(one in complaint.lower() for one in _UNKNOWN):
        return found
    return found._replace(error=clipped(complaint or f"status {done.returncode}", 300))
