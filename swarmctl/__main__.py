"""The console script. Prints ``--version`` without importing the command line; shows no traceback."""

from __future__ import annotations

import sys


def main() -> int:
    """Run the command line; returns the exit code (see ``swarmctl.cli.exit_codes``)."""
    try:
        import gc  # noqa: PLC0415  (Ctrl-C during an import is one line, too)

        from swarmctl import streams  # noqa: PLC0415

        gc.set_threshold(200_000, 50, 1000)  # cycles in the trees of a large spec take a tenth of a plan
        output = streams.install()
        code = _run(sys.argv[1:])
        return code if streams.finish(output) else code or 1
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return 130


def _run(arguments: list[str]) -> int:
    if arguments in (["--version"], ["-V"]):
        from swarmctl.version import __version__  # noqa: PLC0415

        print(f"swarmctl {__version__}")
        return 0
    from swarmctl.cli.app import run  # noqa: PLC0415  (to import typer takes longer than to print the version)

    return run(arguments)


if __name__ == "__main__":
    sys.exit(main())
