"""A process that cannot outlive its test: as a context, `subprocess.Popen` waits for ever after a failure."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any


@contextmanager
def child_process(argv: Sequence[str | Path], **options: Any) -> Iterator[subprocess.Popen[str]]:
    """Start ``argv``; SIGKILL ends what still runs when the block is left."""
    with subprocess.Popen(argv, text=True, **options) as process:
        try:
            yield process
        finally:
            process.kill()
