"""``swarmctl init``: writes a first spec for a new swarm, and the schemas for editors."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import complete, console, exit_codes, file_writes
from swarmctl.cli.spec_args import SpecFiles
from swarmctl.cli.verbs.schema import schema_files

if TYPE_CHECKING:
    from swarmctl.spec.catalog import Catalog

_ROBOTS = ("k3=khepera3", "epuck=epuck")


def init(
    folder: Annotated[
        Path, typer.Argument(metavar="DIR", help="The folder of the new swarm.", show_default=False)
    ] = Path(),
    name: Annotated[
        str, typer.Option("--name", metavar="NAME", help="The swarm's name; by default the folder's.")
    ] = "",
    mode: Annotated[
        str,
        typer.Option(
            "--mode",
            metavar="MODE",
            help="single-minded, leader, central, standalone or combined.",
            autocompletion=complete.modes,
        ),
    ] = "leader",
    robot: Annotated[
        list[str] | None,
        typer.Option(
            "--robot",
            metavar="NAME=TYPE",
            help="A robot, or several like epuck-[1-5], and its type (repeatable); by default "
            f"{' and '.join(_ROBOTS)}.",
        ),
    ] = None,
) -> None:
    """Write a valid spec to DIR/swarm.yaml and the schemas for editors to DIR/.swarmctl.

    No file is overwritten. After an upgrade: swarmctl schema --out DIR/.swarmctl
    """
    from swarmctl.diagnostics import has_errors
    from swarmctl.scaffold.starting_files import starting_spec
    from swarmctl.spec.catalog import load_catalog
    from swarmctl.spec.model import Mode
    from swarmctl.swarm.names import valid_name

    catalog = load_catalog(folder / "robots")
    console.print_diagnostics(catalog.diagnostics)
    if has_errors(catalog.diagnostics):
        raise typer.Exit(exit_codes.ERROR)
    chosen = Mode(_known("mode", mode, [one.value for one in Mode]))
    robots = _robots(robot or _ROBOTS, catalog)
    text = starting_spec(name or valid_name(folder.resolve().name, "swarm"), chosen, robots, catalog.types)
    spec = folder / "swarm.yaml"
    _check(text, spec, catalog)
    _write({spec: text.encode(), **schema_files(folder / ".swarmctl")})
    console.out().print(f"{spec}: {len(robots)} robots, mode {mode}")
    validate = SpecFiles((spec,)).command("validate")
    console.out().print(f"set your hosts and addresses in it, then run: {validate}")


def _robots(given: Sequence[str], catalog: Catalog) -> dict[str, str]:
    """Names to types."""
    robots: dict[str, str] = {}
    for one in given:
        name, _, type_name = one.partition("=")
        if not name or not type_name:
            raise typer.BadParameter(f"`{one}` is not a robot; write NAME=TYPE, like k3=khepera3")
        for robot in _names(name):
            if robot in robots:
                raise typer.BadParameter(f"two robots are called `{robot}`")
            robots[robot] = _known("robot type", type_name, catalog.types)
    return robots


def _names(given: str) -> tuple[str, ...]:
    """The name, or those of a range."""
    from swarmctl.yamltext.hostlist import NoRange, read

    found = read(given)
    if isinstance(found, NoRange):
        raise typer.BadParameter(f"`{given}`: {found.message}")
    return found.names if found else (given,)


def _known(what: str, word: str, known: Iterable[str]) -> str:
    from swarmctl.suggest import did_you_mean

    if word not in known:
        console.fail(
            f"there is no {what} `{word}`", *did_you_mean(word, known, "there are"), code=exit_codes.USAGE
        )
    return word


def _check(text: str, spec: Path, catalog: Catalog) -> None:
    """Exit with the first error of the new spec, such as an invalid name or too many robots."""
    from swarmctl.linter.runner import lint
    from swarmctl.rulebook import Severity
    from swarmctl.spec.load import load_text

    document, found = load_text(text, str(spec), catalog)
    for one in lint(document) if document else found:
        if one.severity is Severity.ERROR:
            console.fail(one.message, *one.help)


def _write(files: Mapping[Path, bytes]) -> None:
    """Write all files or none. An existing file with the same content stays."""
    from swarmctl.yamltext.files import content as read

    try:
        for path, content in files.items():
            if path.exists() and read(path) != content:
                console.fail(
                    f"{path} exists already, and init overwrites no file",
                    "choose another folder: swarmctl init DIR",
                    f"for new schemas beside an old spec: swarmctl schema --out {path.parent}"
                    if path.suffix == ".json"
                    else f"or use this one: swarmctl validate {path}",
                )
        for path, content in files.items():
            if not path.exists():
                file_writes.create(path, content)
    except OSError as error:
        console.fail(console.cannot_write(error, path), "choose another folder")
