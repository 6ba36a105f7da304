"""What the engine of a container has of its image: whether it is there, and for which machine it is built."""

from __future__ import annotations

import os
import subprocess

from .clip import clipped

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .probe_messages import ImageAnswer, ImageRequest

_TIMEOUT = 10.0  # s
_UNKNOWN = ("image not known", "no such image")  # as podman and docker write it


def look(request: ImageRequest) -> ImageAnswer:
    """Returns what the engine has of an image. ``error``: why that is not known."""
    command = [request["engine"], "image", "inspect", "--format", "{{.Architecture}}", request["image"]]
    answer: ImageAnswer = {"there": False, "built_for": "", "machine": os.uname().machine, "error": ""}
    try:
        done = subprocess.run(
            command, stdin=subprocess.DEVNULL, capture_output=True, timeout=_TIMEOUT, check=False
        )
    except subprocess.TimeoutExpired:
        answer["error"] = f"{command[0]} did not answer within {_TIMEOUT:g} s"
        return answer
    except OSError as error:
        answer["error"] = f"{command[0]} cannot be run: {error.strerror}"
        return answer
    complaint = done.stderr.decode("utf-8", "replace").strip()
    if done.returncode == 0:
        answer["there"], answer["built_for"] = (
            True,
            clipped(done.stdout.decode("utf-8", "replace").strip(), 40),
        )
    elif not any(one in complaint.lower() for one in _UNKNOWN):
        answer["error"] = clipped(" ".join(complaint.split()) or f"status {done.returncode}", 300)
    return answer
