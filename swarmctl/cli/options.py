"""Arguments and options that verbs share."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from swarmctl.cli import console, exit_codes, spec_args
from swarmctl.cli.spec_args import SpecFiles

if TYPE_CHECKING:
    pass

_Format = TypeVar("_Format", bound=Enum)

_SPEC: Any = {
    "metavar": "SPEC",
    "parser": spec_args.file,
    "default_factory": lambda: None,
    "show_default": False,
}
Spec = Annotated[SpecFiles, typer.Argument(help="The swarm's YAML file.", callback=spec_args.needed, **_SPEC)]
SpecOrReport = Annotated[
    SpecFiles,
    typer.Argument(help="The swarm's YAML file.", callback=spec_args.needed_without_report, **_SPEC),
]
Archive = Annotated[
    Path | None,
    typer.Option(
        "--from", metavar="ARCHIVE", is_eager=True,
        help="Show what is in an archive of `swarmctl report`; connect to no host.",
    ),
]  # fmt: skip
Specs = Annotated[
    list[SpecFiles], typer.Argument(help="YAML files, one swarm each.", callback=spec_args.each, **_SPEC)
]
AnySpec = Annotated[
    SpecFiles | None, typer.Argument(help="The swarm's YAML file.", callback=spec_args.given, **_SPEC)
]
_FILE: Any = {
    "metavar": "FILE",
    "is_eager": True,
    "help": "Overlay this file on SPEC (repeatable); without SPEC, the first file is the spec.",
}
Overlays = Annotated[list[Path] | None, typer.Option("--file", "-f", **_FILE)]
LongOverlays = Annotated[list[Path] | None, typer.Option("--file", **_FILE)]  # where -f means something else
Workspaces = Annotated[
    list[Path] | None,
    typer.Option(
        "--workspace", metavar="DIR", is_eager=True, exists=True, file_okay=False,
        help="Read the ROS packages in this folder too, beside those in the folder of SPEC (repeatable).",
    ),
]  # fmt: skip
Into = Annotated[
    Path | None,
    typer.Option(
        "--into", metavar="FILE",
        help="Write edits of hosts into this overlay (-f) instead of where their values stand.",
    ),
]  # fmt: skip
Lab = Annotated[
    bool, typer.Option("--lab", help="Use the hosts of the running lab instead of the real hosts.")
]
LabName = Annotated[
    str,
    typer.Option(
        "--lab-name", metavar="NAME", help="The name of the lab, if it differs from the name of the swarm."
    ),
]


def format_of(form: _Format | None, json: bool, usual: _Format) -> _Format:
    """The format that ``--format`` and ``--json`` choose together; exits if they exclude each other."""
    if json and form is not None and form.value != "json":
        console.fail(f"--json and --format {form.value} exclude each other", code=exit_codes.USAGE)
    chosen = type(usual)("json") if json else form or usual
    console.choose_json(chosen.value == "json")
    return chosen


def _offered(context: typer.Context, incomplete: str) -> list[str]:
    from swarmctl.cli import complete  # the help needs none of it

    return complete.selections(context, incomplete)


_LIMIT: Any = {
    "metavar": "SELECTION",
    "autocompletion": _offered,
    "help": "Only these hosts, or those of these robots: pi-*, @group, type:epuck2, !k3 (repeatable).",
}
Limit = Annotated[list[str] | None, typer.Option("--limit", **_LIMIT)]
Selection = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="SELECTION",
        help="Only these robots, programs, hosts: k3, program:map, pi-*, @group, !k3.",
        autocompletion=_offered,
    ),
]
HostOrLimit = Annotated[list[str] | None, typer.Option("--host", "--limit", **_LIMIT)]
PARALLEL = 64  # hosts at the same time
PARALLEL_URGENT = 256  # of `stop` and its like
Executor = Annotated[
    str,
    typer.Option(
        "--executor",
        metavar="dask://HOST:PORT",
        help="Have the workers of this Dask cluster connect to the hosts (see docs/scale.md).",
    ),
]
NoReuse = Annotated[
    bool,
    typer.Option(
        "--no-reuse", envvar="SWARMCTL_NO_REUSE", show_envvar=False,
        help="Log in anew, and keep no connection: without it, the next verb within 60 s uses this one's.",
    ),
]  # fmt: skip
Parallel = Annotated[
    int, typer.Option("--parallel", metavar="N", min=1, max=512, help="Number of hosts at the same time.")
]
WINDOW = 2.0  # s
Window = Annotated[
    float,
    typer.Option(
        "--window", min=0.5, max=10.0, metavar="SECONDS", help="How long the rate of each topic is measured."
    ),
]
StopRobots = Annotated[
    bool,
    typer.Option("--stop-robots", help="Stop robots that move or are under command; they stay stopped."),
]
Json = Annotated[
    bool,
    typer.Option("--json", callback=console.choose_json, help="Print one JSON document on stdout."),
]
FormatJson = Annotated[bool, typer.Option("--json", help="The same as --format json.")]
Details = Annotated[
    bool, typer.Option("--details", "-v", help="Show every host and every step, equal ones too.")
]

Color = Annotated[
    console.Colour | None,
    typer.Option(
        "--color", callback=console.choose_colour, show_default=False,
        help="Colour; auto, the default, depends on the terminal, NO_COLOR, FORCE_COLOR and TERM.",
    ),
]  # fmt: skip
