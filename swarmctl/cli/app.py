"""The verbs, gathered. Importing this module imports no room of the house but the command line itself."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping, Sequence

import typer

from swarmctl import __version__
from swarmctl.cli import access, exits
from swarmctl.cli.deploy import deploy
from swarmctl.cli.driver import driver
from swarmctl.cli.driver_new import new
from swarmctl.cli.driver_test import put_to_the_test
from swarmctl.cli.emulate import emulate
from swarmctl.cli.firmware import firmware
from swarmctl.cli.graph import graph
from swarmctl.cli.init import init
from swarmctl.cli.lab import lab
from swarmctl.cli.mode import mode
from swarmctl.cli.plan import plan
from swarmctl.cli.remove import remove
from swarmctl.cli.render import render
from swarmctl.cli.rules import explain, rules
from swarmctl.cli.schema import schema
from swarmctl.cli.spec import spec
from swarmctl.cli.status import status
from swarmctl.cli.trust import trust
from swarmctl.cli.validate import validate

VERBS: Mapping[Callable[..., None], Sequence[int]] = {  # and the exit codes of their own
    init: (),
    validate: (),
    spec: (),
    render: (),
    graph: (),
    trust: (exits.HOSTS_UNREACHABLE,),
    plan: (exits.CHANGES, exits.HOSTS_FAILED, exits.HOSTS_UNREACHABLE),
    deploy: (exits.HOSTS_FAILED, exits.HOSTS_UNREACHABLE),
    status: (exits.HOSTS_UNREACHABLE, exits.UNHEALTHY),
    remove: (exits.HOSTS_FAILED, exits.HOSTS_UNREACHABLE),
    rules: (),
    explain: (),
    schema: (),
    emulate: (),
}

app = typer.Typer(
    name="swarmctl", no_args_is_help=True, rich_markup_mode=None,
    pretty_exceptions_enable=False, epilog=exits.told(*exits.MEANING),
    context_settings={"help_option_names": ["-h", "--help"]},
)  # fmt: skip
for verb, codes in VERBS.items():
    app.command(epilog=exits.told(*codes))(verb)
app.add_typer(mode, name="mode")
app.add_typer(lab, name="lab")
driver.command(epilog=exits.told())(new)
driver.command(name="test", epilog=exits.told())(put_to_the_test)
app.add_typer(driver, name="driver")
app.add_typer(firmware, name="firmware")


def _version(asked: bool) -> None:
    if asked:
        typer.echo(f"swarmctl {__version__}")
        raise typer.Exit


@app.callback()
def swarmctl(
    version: bool = typer.Option(
        False, "--version", "-V", callback=_version, is_eager=True, help="Print the version."
    ),
    color: access.Color = None,
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
