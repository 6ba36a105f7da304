"""The console script. Prints ``--version`` without importing the command line; shows no traceback."""

from __future__ import annotations

import gc
import sys

from swarmctl import streams
from swarmctl.version import __version__


def main() -> int:
    """Run the command line; returns the exit code (see ``swarmctl.cli.exit_codes``)."""
    gc.set_threshold(
        200_000, 50, 1000
    )  # to look for cycles in the trees of a large spec takes a tenth of a plan
    output = streams.install()
    code = _run(sys.argv[1:])
    return code if streams.finish(output) else code or 1


def _run(arguments: list[str]) -> int:
    if arguments in (["--version"], ["-V"]):
        print(f"swarmctl {__version__}")
        return 0
    try:
        from swarmctl.cli.app import run  # noqa: PLC0415  (to import typer takes longer than to print the version)
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return 130

    return run(arguments)


if __name__ == "__main__":
    sys.exit(main())
