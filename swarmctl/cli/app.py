"""Registers the verbs. Importing this module imports no package of swarmctl but ``cli``."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping, Sequence

import typer

from swarmctl import __version__
from swarmctl.cli import exit_codes, options
from swarmctl.cli.verbs.deploy import deploy
from swarmctl.cli.verbs.driver import driver
from swarmctl.cli.verbs.driver_new import new
from swarmctl.cli.verbs.driver_test import driver_test
from swarmctl.cli.verbs.emulate import emulate
from swarmctl.cli.verbs.firmware import firmware
from swarmctl.cli.verbs.graph import graph
from swarmctl.cli.verbs.init import init
from swarmctl.cli.verbs.lab import lab
from swarmctl.cli.verbs.migrate import migrate
from swarmctl.cli.verbs.mode import mode
from swarmctl.cli.verbs.plan import plan
from swarmctl.cli.verbs.remove import remove
from swarmctl.cli.verbs.render import render
from swarmctl.cli.verbs.rules import explain, rules
from swarmctl.cli.verbs.schema import schema
from swarmctl.cli.verbs.spec import spec
from swarmctl.cli.verbs.status import status
from swarmctl.cli.verbs.trust import trust
from swarmctl.cli.verbs.validate import validate

VERBS: Mapping[Callable[..., None], Sequence[int]] = {  # with their own exit codes
    init: (),
    validate: (),
    spec: (),
    migrate: (),
    render: (),
    graph: (),
    trust: (exit_codes.HOSTS_UNREACHABLE,),
    plan: (exit_codes.CHANGES, exit_codes.HOSTS_FAILED, exit_codes.HOSTS_UNREACHABLE),
    deploy: (exit_codes.HOSTS_FAILED, exit_codes.HOSTS_UNREACHABLE),
    status: (exit_codes.HOSTS_UNREACHABLE, exit_codes.UNHEALTHY),
    remove: (exit_codes.HOSTS_FAILED, exit_codes.HOSTS_UNREACHABLE),
    rules: (),
    explain: (),
    schema: (),
    emulate: (),
}

app = typer.Typer(
    name="swarmctl", no_args_is_help=True, rich_markup_mode=None,
    pretty_exceptions_enable=False, epilog=exit_codes.epilog(*exit_codes.MEANING),
    context_settings={"help_option_names": ["-h", "--help"]},
)  # fmt: skip
for verb, codes in VERBS.items():
    app.command(epilog=exit_codes.epilog(*codes))(verb)
app.add_typer(mode, name="mode")
app.add_typer(lab, name="lab")
driver.command(epilog=exit_codes.epilog())(new)
driver.command(name="test", epilog=exit_codes.epilog())(driver_test)
app.add_typer(driver, name="driver")
app.add_typer(firmware, name="firmware")


def _version(requested: bool) -> None:
    if requested:
        typer.echo(f"swarmctl {__version__}")
        raise typer.Exit


@app.callback()
def swarmctl(
    version: bool = typer.Option(
        False, "--version", "-V", callback=_version, is_eager=True, help="Print the version."
    ),
    color: options.Color = None,
) -> None:
    """Describe a ROS robot swarm in one YAML file: check, render, deploy and monitor it."""


def run(arguments: Sequence[str]) -> int:
    """Run one command line and return its exit code. No exception leaves this function."""
    try:
        result = app(list(arguments), prog_name="swarmctl", standalone_mode=False)
        return result if isinstance(result, int) else exit_codes.OK
    except (typer.Abort, KeyboardInterrupt):
        print("interrupted", file=sys.stderr)
        return exit_codes.INTERRUPTED
    except Exception as error:
        if hasattr(error, "format_message"):  # a usage error of the command line
            return _usage(error.format_message(), getattr(error, "ctx", None))
        if os.environ.get("SWARMCTL_DEBUG"):
            raise
        print(f"error: {type(error).__name__}: {error}", file=sys.stderr)
        print("  this is a bug in swarmctl; SWARMCTL_DEBUG=1 shows where it happened", file=sys.stderr)
        return exit_codes.ERROR


def _usage(message: str, context: typer.Context | None) -> int:
    if message.startswith("Usage:"):  # no arguments at all: the message is the help
        print(message, file=sys.stderr)
        return exit_codes.USAGE
    print(f"error: {message}", file=sys.stderr)
    if context is not None:
        print(f"  {context.get_usage()}", file=sys.stderr)
        print(f"  help: {context.command_path} --help", file=sys.stderr)
    return exit_codes.USAGE
