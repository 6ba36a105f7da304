"""The verbs, gathered. Importing this module imports no room of the house but the command line itself."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

import typer

from swarmctl import __version__
from swarmctl.cli import exits
from swarmctl.cli.deploy import deploy
from swarmctl.cli.emulate import emulate
from swarmctl.cli.init import init
from swarmctl.cli.lab import lab
from swarmctl.cli.plan import plan
from swarmctl.cli.remove import remove
from swarmctl.cli.render import render
from swarmctl.cli.rules import explain, rules
from swarmctl.cli.schema import schema
from swarmctl.cli.status import status
from swarmctl.cli.trust import trust
from swarmctl.cli.validate import validate

EPILOG = (
    "Exit codes: 0 done; 1 error or wrong spec; 2 changes (plan --detailed-exitcode); 3 some hosts failed; "
    "4 some hosts unreachable; 5 unhealthy; 64 usage; 130 interrupted."
)

app = typer.Typer(
    name="swarmctl", no_args_is_help=True, rich_markup_mode=None,
    pretty_exceptions_enable=False, epilog=EPILOG,
    context_settings={"help_option_names": ["-h", "--help"]},
)  # fmt: skip
VERBS = (
    init,
    validate,
    render,
    trust,
    plan,
    deploy,
    status,
    remove,
    rules,
    explain,
    schema,
    emulate,
)
for verb in VERBS:
    app.command()(verb)
app.add_typer(lab, name="lab")


def _version(asked: bool) -> None:
    if asked:
        typer.echo(f"swarmctl {__version__}")
        raise typer.Exit


@app.callback()
def swarmctl(
    version: bool = typer.Option(
        False, "--version", "-V", callback=_version, is_eager=True, help="Print the version."
    ),
) -> None:
    """One YAML file describes a robot swarm: check it, render it, deploy it, watch over it."""


def run(arguments: Sequence[str]) -> int:
    """Run one command line and return its exit code. No exception leaves this function."""
    try:
        result = app(list(arguments), prog_name="swarmctl", standalone_mode=False)
        return result if isinstance(result, int) else exits.OK
    except (typer.Abort, KeyboardInterrupt):
        print("interrupted", file=sys.stderr)
        return exits.INTERRUPTED
    except BrokenPipeError:
        raise
    except Exception as error:
        if hasattr(error, "format_message"):  # a usage error of the command line
            return _usage(error.format_message(), getattr(error, "ctx", None))
        if os.environ.get("SWARMCTL_DEBUG"):
            raise
        print(f"error: {type(error).__name__}: {error}", file=sys.stderr)
        print("  this is a bug in swarmctl; SWARMCTL_DEBUG=1 shows where it happened", file=sys.stderr)
        return exits.ERROR


def _usage(message: str, context: typer.Context | None) -> int:
    if message.startswith("Usage:"):  # no arguments at all: the message is the help
        print(message, file=sys.stderr)
        return exits.USAGE
    print(f"error: {message}", file=sys.stderr)
    if context is not None:
        print(f"  {context.get_usage()}", file=sys.stderr)
        print(f"  help: {context.command_path} --help", file=sys.stderr)
    return exits.USAGE
