"""Runs a command on a terminal of its own."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Sequence
from pathlib import Path


def shown_by(argv: Sequence[str | Path], typed: str = "", **environment: str) -> str:
    """Everything that the command shows, with what is ``typed``; ``environment`` comes beside ours."""
    terminal, end = os.openpty()
    program = subprocess.Popen(argv, env={**os.environ, **environment}, stdin=end, stdout=end, stderr=end)
    os.close(end)
    os.write(terminal, typed.encode())
    text = b""
    try:
        while piece := os.read(terminal, 4096):
            text += piece
    except OSError:  # how Linux ends a terminal without a program
        pass
    finally:
        os.close(terminal)
        program.wait()
    return text.decode()
