"""``swarmctl mode``: infers the mode of a spec, and converts a spec to another mode."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import complete, console, exit_codes, file_writes, next_command, options

if TYPE_CHECKING:
    from swarmctl.mode_conversion.convert import Conversion
    from swarmctl.spec.load import Document
    from swarmctl.spec.model import Mode

mode = typer.Typer(
    name="mode", no_args_is_help=True, help="Infer the mode of a spec, or convert it to another mode."
)


@mode.command(epilog=exit_codes.epilog())
def infer(spec: options.Spec, overlays: options.Overlays = None, json: options.Json = False) -> None:
    """Infer the mode and show the edit to the declared one. Exit code 1 if they differ."""
    from swarmctl.mode_conversion.infer import infer as inferred
    from swarmctl.swarm.index import SwarmIndex

    document = console.read_document(spec)
    found, declared = inferred(SwarmIndex(document)), document.spec.mode
    same = found.mode is declared
    edit, problem = ("", "") if same else _edit(document, declared)
    if json:
        modes = {"mode": found.mode.value, "declared": declared.value, "hub": found.hub}
        console.print_json({"v": 1, **modes, "because": list(found.because), "edit": edit})
    else:
        other = "" if same else f", but {declared.value} is declared"
        console.show(f"the mode is {found.mode.value}{other}")
        for line in found.because:
            console.show(f"  {line}")
        if edit:
            console.out().print(f"\nedit to make it {declared.value}:\n\n{edit}", end="")
        if problem:
            console.show(f"no edit makes it {declared.value}: {problem}", error=True)
        elif edit and len(spec.files) == 1:
            next_command.advise("mode convert", spec, "--to", declared.value, "--write")
    raise typer.Exit(exit_codes.OK if same else exit_codes.ERROR)


@mode.command(epilog=exit_codes.epilog())
def convert(
    spec: options.Spec,
    to: Annotated[
        str, typer.Option("--to", metavar="MODE", help="The new mode.", autocompletion=complete.modes)
    ],
    write: Annotated[
        bool, typer.Option("--write", help="Write the file; by default the edit is only shown.")
    ] = False,
) -> None:
    """Convert a spec to another mode with the smallest edit. Comments and layout stay."""
    document = console.read_document(spec)
    conversion = _converted(document, to)
    if found := _wrong(document, conversion):
        console.fail(f"{spec} cannot be converted to mode `{to}` automatically", *found)
    change = _change(document, conversion)
    if write:
        file_writes.write([change])
        console.err().print(f"{spec}: mode {to}, {len(conversion.changes)} changes")
    else:
        print(file_writes.difference(change), end="")
    for line in conversion.notes:
        console.show(f"note: {line}", error=True)
    for line in conversion.by_hand:
        console.show(f"by hand: {line}", error=True)
    next_command.advise(*(("validate", spec) if write else ("mode convert", spec, "--to", to, "--write")))


def _converted(document: Document, to: str) -> Conversion:
    from swarmctl.mode_conversion.arrangement import ArrangementError
    from swarmctl.mode_conversion.convert import converted
    from swarmctl.spec.model import Mode
    from swarmctl.suggest import did_you_mean

    known = [one.value for one in Mode]
    if to not in known:
        console.fail(
            f"there is no mode `{to}`", *did_you_mean(to, known, "the modes are"), code=exit_codes.USAGE
        )
    try:
        return converted(document, Mode(to))
    except ArrangementError as error:
        console.fail(*error.args)


def _edit(document: Document, to: Mode) -> tuple[str, str]:
    """The edit that makes the wiring that of mode ``to``, or none and the reason."""
    from swarmctl.mode_conversion.arrangement import ArrangementError
    from swarmctl.mode_conversion.convert import converted

    try:
        conversion = converted(document, to)
    except ArrangementError as error:
        return "", str(error.args[0])
    if found := _wrong(document, conversion):
        return "", found[0]
    return file_writes.difference(_change(document, conversion)), ""


def _wrong(document: Document, conversion: Conversion) -> list[str]:
    """The errors of the converted text."""
    from swarmctl.linter.runner import lint
    from swarmctl.rulebook import Severity
    from swarmctl.spec.load import load_text
    from swarmctl.yamltext import hostlist

    if conversion.undone:
        ranges = "; ".join(text for text, _ in hostlist.ranges_of(conversion.undone))
        undone = re.sub(r"\[\[(.*?)\]\]", r"[\1]", ranges)  # links[[1-3]] -> links[1-3]
        return [
            f"in another file, or for only some elements of a range: {undone}",
            "make these changes by hand, or convert one file without ranges: `swarmctl spec --expanded`",
        ]
    result, found = load_text(conversion.text, document.source.path, document.catalog)
    found = found if result is None else lint(result)
    return [f"{one.code}: {one.message}" for one in found if one.severity is Severity.ERROR]


def _change(document: Document, conversion: Conversion) -> file_writes.Change:
    from swarmctl.yamltext.files import content

    source = document.source
    return file_writes.Change(content(Path(source.path)), source.path, source.text, conversion.text)
