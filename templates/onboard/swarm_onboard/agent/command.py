"""Runs a program of the host to its end, within a time limit, and reports its output."""

from __future__ import annotations

import os
import subprocess
import threading
from collections import deque

from .errors import FailedError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Callable, Mapping, Sequence

_LAST = 5  # lines of a failed program's output that the error contains


def output_of(argv: Sequence[str], timeout: float = 20.0) -> str:
    """Returns the standard output, whatever the status; empty if the program cannot run."""
    try:
        done = subprocess.run(
            argv,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=timeout,
            check=False,
            env=plain_environment(),
        )
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.decode("utf-8", "replace")


def run(
    argv: Sequence[str],
    what: str,
    *,
    timeout: float,
    line: Callable[[str], None] = lambda _: None,
    env: Mapping[str, str] = {},
) -> None:
    """Runs ``argv`` and calls ``line`` with each line of its output.

    Raises ``FailedError``, which names ``what`` failed, with the last lines of the output.
    """
    last: deque[str] = deque(maxlen=_LAST)
    try:
        process = subprocess.Popen(
            argv,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            env=plain_environment(env),
            start_new_session=True,
        )
    except OSError as error:
        raise FailedError(f"{what} failed: {argv[0]}: {error.strerror}", "is it installed?") from error
    ended = threading.Timer(timeout, process.kill)
    ended.start()
    try:
        assert process.stdout is not None
        for raw in process.stdout:
            text = raw.decode("utf-8", "replace").rstrip()
            if text:
                last.append(text)
                line(text)
        status = process.wait()
    finally:
        late = not ended.is_alive()
        ended.cancel()
    if late:
        raise FailedError(f"{what} did not end within {timeout:.0f} s", "run the same command again")
    if status != 0:
        raise FailedError(f"{what} failed: {'; '.join(last)}"[:1500], "correct it, then run prepare again")


def plain_environment(env: Mapping[str, str] = {}) -> dict[str, str]:
    """Returns an environment in which programs ask nothing and write English."""
    kept = {name: os.environ[name] for name in ("PATH", "SWARM_PREFIX") if name in os.environ}
    usual = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"
    path = f"{kept.get('PATH', '')}:{usual}".lstrip(":")
    return {**kept, "PATH": path, "LC_ALL": "C", "HOME": "/root", "DEBIAN_FRONTEND": "noninteractive", **env}
