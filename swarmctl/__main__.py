"""The console script: answers ``--version`` at once, and lets no traceback reach a person."""

from __future__ import annotations

import io
import os
import sys

from swarmctl import __version__


def main() -> int:
    """Run the command line; returns the exit code (see ``swarmctl.cli.exits``)."""
    if sys.argv[1:] in (["--version"], ["-V"]):
        print(f"swarmctl {__version__}")
        return 0
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a letter that the terminal does not know is no error
            stream.reconfigure(errors="backslashreplace")
    from swarmctl.cli.app import run  # noqa: PLC0415  (typer costs more than the version is worth)

    try:
        return run(sys.argv[1:])
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0


if __name__ == "__main__":
    sys.exit(main())
