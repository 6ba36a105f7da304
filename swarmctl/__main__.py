"""The console script. Prints ``--version`` without importing the command line; shows no traceback."""

from __future__ import annotations

import io
import os
import sys

from swarmctl import __version__


def main() -> int:
    """Run the command line; returns the exit code (see ``swarmctl.cli.exit_codes``)."""
    if sys.argv[1:] in (["--version"], ["-V"]):
        print(f"swarmctl {__version__}")
        return 0
    _replace_closed_streams()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # characters that the terminal cannot show are escaped
            stream.reconfigure(errors="backslashreplace")
    from swarmctl.cli.app import run  # noqa: PLC0415  (importing typer takes longer than printing the version)

    try:
        return run(sys.argv[1:])
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0


def _replace_closed_streams() -> None:
    """Opens /dev/null for standard streams that the caller closed, so that no other file reuses them."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: PTH123, SIM115


if __name__ == "__main__":
    sys.exit(main())
