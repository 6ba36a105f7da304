"""Registers the verbs. Importing this module imports none of them and no package of swarmctl but ``cli``."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from typing import ClassVar

import typer

from swarmctl.cli import exit_codes, options
from swarmctl.cli.exit_codes import CHANGES, HOSTS_FAILED, HOSTS_UNREACHABLE, NOT_PROVEN, UNHEALTHY
from swarmctl.cli.lazy_verbs import LazyVerbs, Verb
from swarmctl.version import __version__

_WRITE = (
    Verb(
        "init",
        "Write a valid spec to DIR/swarm.yaml and the schemas for editors to DIR/.swarmctl.",
        example="init lab --robot k3=khepera3 --robot koala=koala",
    ),
    Verb(
        "import",
        "Draft a spec from launch files, scripts, Compose files, an Ansible inventory or a robot.yaml.",
        example="import ~/lab -o swarm.yaml",
    ),
    Verb(
        "spec",
        "Print the effective spec: files merged, ranges and selections expanded, defaults applied.",
        example="spec swarm.yaml -f night.yaml",
    ),
    Verb(
        "mode",
        "Infer the mode of a spec, or convert it to another mode.",
        example="mode convert swarm.yaml --to leader",
    ),
    Verb(
        "swap",
        "Exchange the devices of two robots: addresses, calibration and wiring. Names and roles stay.",
        example="swap swarm.yaml epuck-1 epuck-2",
    ),
    Verb(
        "rename",
        "Rename a host, robot, program or group in all files of a spec. Comments and layout stay.",
        example="rename swarm.yaml k3-pi pi-3",
    ),
    Verb(
        "driver",
        "Show robot types, write your own, test a robot with it.",
        example="driver show khepera3",
    ),
    Verb(
        "schema",
        "Print the JSON Schema of a spec or of a robot type (draft-07), of status --json or of a capsule.",
        example="schema swarm",
    ),
)
_CHECK = (
    Verb("validate", "Check specs.", example="validate swarm.yaml --fix"),
    Verb("rules", "List the rules that check a spec.", example="rules"),
    Verb(
        "explain",
        "Explain one rule: what it finds, why it matters, how to fix it.",
        module="rules",
        example="explain NET001",
    ),
    Verb("graph", "Show a swarm as a graph, or analyse it.", example="graph swarm.yaml --impact"),
    Verb("render", "Write the release of each host to DIR/HOST.", example="render swarm.yaml --out out"),
    Verb(
        "lab",
        "Run the swarm on this machine: real hosts in namespaces, emulated robots.",
        example="lab up swarm.yaml",
    ),
    Verb("emulate", "Run one emulated robot on a pty.", example="emulate khepera3"),
)
_BRING = (
    Verb(
        "trust",
        "Show the SSH keys of new hosts and pin them in NAME.known_hosts beside the spec.",
        HOSTS_UNREACHABLE,
        example="trust swarm.yaml",
    ),
    Verb(
        "rekey",
        "Give the hosts of a sealed swarm new WireGuard keys; the old ones are worth nothing then.",
        HOSTS_FAILED,
        HOSTS_UNREACHABLE,
        example="rekey swarm.yaml",
    ),
    Verb(
        "expel",
        "Retire the WireGuard keys of a lost host on all others, at once and for good.",
        HOSTS_FAILED,
        HOSTS_UNREACHABLE,
        module="rekey",
        example="expel swarm.yaml k3-pi",
    ),
    Verb(
        "keys",
        "Make the keys of SROS 2 that are missing, and sign permissions that have changed.",
        example="keys swarm.yaml",
    ),
    Verb(
        "prepare",
        "Install on each host what it lacks: account, packages, groups, built workspace.",
        HOSTS_FAILED,
        HOSTS_UNREACHABLE,
        example="prepare swarm.yaml",
    ),
    Verb(
        "plan",
        "Show the steps of a deploy on each host, with their causes.",
        CHANGES,
        HOSTS_FAILED,
        HOSTS_UNREACHABLE,
        example="plan swarm.yaml",
    ),
    Verb(
        "deploy",
        "Deploy the spec to its hosts, wave by wave.",
        HOSTS_FAILED,
        HOSTS_UNREACHABLE,
        UNHEALTHY,
        example="deploy swarm.yaml --yes",
    ),
    Verb(
        "watch",
        "Keep the hosts at the release of the spec until Ctrl-C: each gets it once it answers.",
        example="watch swarm.yaml",
    ),
    Verb(
        "adopt",
        "Bring what was edited on hosts into the files of the spec.",
        HOSTS_UNREACHABLE,
        example="adopt swarm.yaml k3-pi",
    ),
    Verb(
        "history",
        "List the runs that changed the hosts, or who commanded their robots.",
        HOSTS_FAILED,
        HOSTS_UNREACHABLE,
        example="history swarm.yaml",
    ),
    Verb(
        "rollback",
        "Bring hosts back to the releases that they had before the last run.",
        HOSTS_FAILED,
        HOSTS_UNREACHABLE,
        UNHEALTHY,
        example="rollback swarm.yaml",
    ),
    Verb(
        "remove",
        "Remove the swarm from its hosts: stop the robots; remove units, links and /opt/swarm/<name>.",
        HOSTS_FAILED,
        HOSTS_UNREACHABLE,
        example="remove swarm.yaml",
    ),
    Verb(
        "firmware",
        "Build the sketch of a robot's board and write it to the board.",
        example="firmware flash swarm.yaml rover",
    ),
)
_LOOK = (
    Verb(
        "status",
        "Show the health of hosts, robots and programs.",
        HOSTS_UNREACHABLE,
        UNHEALTHY,
        example="status swarm.yaml --watch",
    ),
    Verb(
        "ui",
        "Serve a local web page that shows the swarm: its graph and its health, live, until Ctrl-C.",
        example="ui swarm.yaml",
    ),
    Verb(
        "record",
        "Record topics in bags, on the hosts that publish them, until Ctrl-C; then fetch the bags.",
        HOSTS_FAILED,
        HOSTS_UNREACHABLE,
        example="record swarm.yaml '/k3/*' --duration 60",
    ),
    Verb(
        "capsule",
        "Check, list, compare and export capsules, the folders that trials leave.",
        example="capsule show trials",
    ),
    Verb(
        "logs",
        "Show what drivers and programs have logged, of all hosts in the order of time.",
        HOSTS_FAILED,
        HOSTS_UNREACHABLE,
        example="logs swarm.yaml k3 --since 10m --level warn",
    ),
    Verb(
        "top",
        "Show what each robot's driver and each program costs its host: CPU and memory.",
        HOSTS_FAILED,
        HOSTS_UNREACHABLE,
        example="top swarm.yaml",
    ),
    Verb(
        "topic",
        "List, show, measure and publish topics, on the hosts.",
        example="topic echo swarm.yaml /k3/odom",
    ),
    Verb(
        "exec",
        "Run a command on hosts, at once.",
        HOSTS_FAILED,
        HOSTS_UNREACHABLE,
        example="exec swarm.yaml '*' -- uptime",
    ),
    Verb(
        "ssh",
        "Open a shell on a host, or run a command there at this terminal.",
        example="ssh swarm.yaml k3",
    ),
    Verb(
        "doctor",
        "Find what keeps this machine from a host, one check after the other, each with its remedy.",
        UNHEALTHY,
        example="doctor swarm.yaml k3",
    ),
    Verb(
        "report",
        "Write one archive for those who help: spec, plan, status, logs and graph, without secrets.",
        HOSTS_UNREACHABLE,
        example="report swarm.yaml",
    ),
    Verb(
        "exporter",
        "Serve the health of the swarm to Prometheus, until Ctrl-C.",
        example="exporter swarm.yaml",
    ),
)
_DRIVE = (
    Verb(
        "stop",
        "Stop robots at once, and keep them stopped until `swarmctl start`.",
        HOSTS_FAILED,
        HOSTS_UNREACHABLE,
        NOT_PROVEN,
        example="stop",
    ),
    Verb(
        "start",
        "Release robots that `swarmctl stop` has stopped; each stands until its next command.",
        HOSTS_FAILED,
        HOSTS_UNREACHABLE,
        module="stop",
        example="start swarm.yaml koala",
    ),
    Verb(
        "restart",
        "Restart the drivers and other units of robots.",
        HOSTS_FAILED,
        HOSTS_UNREACHABLE,
        module="stop",
        example="restart swarm.yaml k3",
    ),
    Verb(
        "ready",
        "Show whether a trial can begin: hosts, release, clocks, disks, batteries, devices, drivers, topics.",
        UNHEALTHY,
        example="ready swarm.yaml circles",
    ),
    Verb(
        "run",
        "Run the trials of an experiment, each kept as a capsule.",
        HOSTS_FAILED,
        HOSTS_UNREACHABLE,
        UNHEALTHY,
        example="run swarm.yaml circles",
    ),
)


class Verbs(LazyVerbs):
    """All verbs, in the order of ``--help``. Each is a function or a group in ``swarmctl/cli/verbs``."""

    groups: ClassVar[Mapping[str, Sequence[Verb]]] = {
        "Write a spec": _WRITE,
        "Check it": _CHECK,
        "Bring it to the hosts": _BRING,
        "Look": _LOOK,
        "Drive": _DRIVE,
    }
    verbs = tuple(verb for group in groups.values() for verb in group)


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
