"""``swarmctl swap``: a robot takes the place of another; names and roles stay."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import complete, console, exit_codes, file_writes, next_command, options

if TYPE_CHECKING:
    from collections.abc import Mapping

    from swarmctl.cli.spec_args import SpecFiles


def swap(
    spec: options.Spec,
    robot: Annotated[
        list[str],
        typer.Argument(metavar="ROBOT", help="The robot that is replaced.", autocompletion=complete.robots),
    ],
    replacement: Annotated[
        str,
        typer.Option(
            "--with", metavar="ROBOT", help="The robot that takes its place.", autocompletion=complete.robots
        ),
    ],
    write: Annotated[
        bool, typer.Option("--write", help="Write the file; by default the edit is only shown.")
    ] = False,
) -> None:
    """Exchange the devices of two robots: addresses, calibration and wiring. Names and roles stay."""
    from swarmctl.spec import swap as swaps
    from swarmctl.yamltext.edits import apply

    if len(robot) != 1:
        console.fail("`swap` takes one robot", "name its replacement with `--with`", code=exit_codes.USAGE)
    document = console.read_document(spec)
    try:
        found = swaps.swap(document, robot[0], replacement)
    except swaps.SwapError as error:
        console.fail(*error.args)
    before = {file: document.source.texts[file] for file in found.edits}
    after = {file: apply(text, found.edits[file]) for file, text in before.items()}
    _check(spec, after)
    changes = [_change(file, before[file], after[file]) for file in after]
    if write:
        file_writes.write(changes)
        moved = ", ".join(f"`{key}`" for key in found.moved)
        console.err().print(f"{spec}: `{robot[0]}` and `{replacement}` exchanged {moved}")
        next_command.advise("plan", spec)
    else:
        print("".join(map(file_writes.difference, changes)), end="")
        next_command.advise("swap", spec, robot[0], "--with", replacement, "--write")


def _check(spec: SpecFiles, texts: Mapping[str, str]) -> None:
    """Exit if the changed spec has errors; the spec had none."""
    from swarmctl.cli.spec_fixes import SpecFixes
    from swarmctl.rulebook import Severity

    found = SpecFixes(spec).found_with(texts).diagnostics
    if errors := [f"{one.code}: {one.message}" for one in found if one.severity is Severity.ERROR]:
        console.fail(f"{spec} would have errors after it, and was not changed", *errors)


def _change(file: str, before: str, after: str) -> file_writes.Change:
    from pathlib import Path

    from swarmctl.yamltext.files import content

    return file_writes.Change(content(Path(file)), file, before, after)
