"""Registers the verbs. Importing this module imports none of them and no package of swarmctl but ``cli``."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

import typer

from swarmctl.cli import exit_codes, options
from swarmctl.cli.exit_codes import CHANGES, HOSTS_FAILED, HOSTS_UNREACHABLE, NOT_PROVEN, UNHEALTHY
from swarmctl.cli.lazy_verbs import LazyVerbs, Verb
from swarmctl.version import __version__


class Verbs(LazyVerbs):
    """All verbs, in the order of ``--help``. Each is a function or a group in ``swarmctl/cli/verbs``."""

    verbs = (
        Verb("init", "Write a valid spec to DIR/swarm.yaml and the schemas for editors to DIR/.swarmctl."),
        Verb(
            "import",
            "Draft a spec from launch files and scripts, an Ansible inventory or a Clearpath robot.yaml.",
        ),
        Verb("validate", "Check specs."),
        Verb(
            "spec",
            "Print the effective spec: files merged, ranges and selections expanded, defaults applied.",
        ),
        Verb("render", "Write the release of each host to DIR/HOST."),
        Verb("graph", "Show a swarm as a graph, or analyse it."),
        Verb(
            "trust",
            "Show the SSH keys of new hosts and pin them in NAME.known_hosts beside the spec.",
            HOSTS_UNREACHABLE,
        ),
        Verb(
            "prepare",
            "Install on each host what it lacks: account, packages, groups, built workspace.",
            HOSTS_FAILED,
            HOSTS_UNREACHABLE,
        ),
        Verb(
            "plan",
            "Show the steps of a deploy on each host, with their causes.",
            CHANGES,
            HOSTS_FAILED,
            HOSTS_UNREACHABLE,
        ),
        Verb(
            "adopt",
            "Bring what was edited on hosts into the files of the spec.",
            HOSTS_UNREACHABLE,
        ),
        Verb("deploy", "Deploy the spec to its hosts, wave by wave.", HOSTS_FAILED, HOSTS_UNREACHABLE),
        Verb(
            "history",
            "List the runs that changed the hosts, from their logs.",
            HOSTS_FAILED,
            HOSTS_UNREACHABLE,
        ),
        Verb(
            "rollback",
            "Bring hosts back to the releases that they had before the last run.",
            HOSTS_FAILED,
            HOSTS_UNREACHABLE,
        ),
        Verb("status", "Show the health of hosts, robots and programs.", HOSTS_UNREACHABLE, UNHEALTHY),
        Verb("exporter", "Serve the health of the swarm to Prometheus, until Ctrl-C."),
        Verb(
            "stop",
            "Stop robots at once, and keep them stopped until `swarmctl start`.",
            HOSTS_FAILED,
            HOSTS_UNREACHABLE,
            NOT_PROVEN,
        ),
        Verb(
            "start",
            "Release robots that `swarmctl stop` has stopped; each stands until its next command.",
            HOSTS_FAILED,
            HOSTS_UNREACHABLE,
        ),
        Verb("restart", "Restart the drivers and other units of robots.", HOSTS_FAILED, HOSTS_UNREACHABLE),
        Verb(
            "remove",
            "Remove the swarm from its hosts: stop the robots; remove units, links and /opt/swarm/<name>.",
            HOSTS_FAILED,
            HOSTS_UNREACHABLE,
        ),
        Verb("rules", "List the rules that check a spec."),
        Verb("explain", "Explain one rule: what it finds, why it matters, how to fix it.", module="rules"),
        Verb(
            "schema",
            "Print the JSON Schema of a spec or of a robot type (draft-07), or of what status --json prints.",
        ),
        Verb("emulate", "Run one emulated robot on a pty."),
        Verb("mode", "Infer the mode of a spec, or convert it to another mode."),
        Verb(
            "swap",
            "Exchange the devices of two robots: addresses, calibration and wiring. Names and roles stay.",
        ),
        Verb("lab", "Run the swarm on this machine: real hosts in namespaces, emulated robots."),
        Verb("driver", "Show robot types, write your own, test a robot with it."),
        Verb("firmware", "Build the sketch of a robot's board and write it to the board."),
    )


app = typer.Typer(
    name="swarmctl", cls=Verbs, no_args_is_help=True, rich_markup_mode=None,
    pretty_exceptions_enable=False, epilog=exit_codes.epilog(*exit_codes.MEANING),
    context_settings={"help_option_names": ["-h", "--help"]},
)  # fmt: skip


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
