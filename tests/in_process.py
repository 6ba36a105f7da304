"""Runs a verb in this process, for tests that do not depend on how a process starts or ends."""

from __future__ import annotations

import contextvars
import io
import subprocess
from collections.abc import Mapping
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import pytest

from swarmctl.cli import console
from swarmctl.cli.app import run


def swarmctl(
    *arguments: str, cwd: Path | None = None, env: Mapping[str, str | None] | None = None
) -> subprocess.CompletedProcess[str]:
    """What a process would print and return, without a terminal; in ``env`` None removes a variable."""
    out, err = (io.TextIOWrapper(io.BytesIO(), "utf-8", write_through=True) for _ in range(2))
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(out), redirect_stderr(err):
        patch.setattr("sys.stdin", io.StringIO())
        for name, value in (env or {}).items():
            if value is None:
                patch.delenv(name, raising=False)
            else:
                patch.setenv(name, value)
        if cwd is not None:
            patch.chdir(cwd)
        console._console.cache_clear()  # it has the width of an earlier run
        code = contextvars.copy_context().run(run, list(arguments))  # no choice of colour stays
        console._console.cache_clear()
    texts = [stream.buffer.getvalue().decode() for stream in (out, err)]  # type: ignore[attr-defined]
    return subprocess.CompletedProcess(arguments, code, *texts)
