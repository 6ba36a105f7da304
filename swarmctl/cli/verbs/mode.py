"""``swarmctl mode``: infers the mode of a spec, and converts a spec to another mode."""

from __future__ import annotations

import re
from dataclasses import replace
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
        str | None,
        typer.Option("--to", metavar="MODE", help="The new mode.", autocompletion=complete.modes),
    ] = None,
    ros: Annotated[
        str | None, typer.Option("--ros", metavar="DISTRO", help="The new ROS distribution, such as jazzy.")
    ] = None,
    write: Annotated[
        bool, typer.Option("--write", help="Write the file; by default the edit is only shown.")
    ] = False,
) -> None:
    """Convert a spec to another mode or ROS with the smallest edit. Comments and layout stay."""
    if (to is None) == (ros is None):
        console.fail("name the new mode by --to, or the new ROS by --ros", code=exit_codes.USAGE)
    document = console.read_document(spec)
    conversion = _converted(document, to) if to is not None else _for_ros(document, ros or "")
    new = f"mode {to}" if to is not None else f"ROS {ros}"
    option = ("--to", to) if to is not None else ("--ros", ros)
    if found := _wrong(document, conversion):
        console.fail(f"{spec} cannot be converted to {new} automatically", *found)
    change = _change(document, conversion)
    if write:
        file_writes.write([change])
        console.err().print(f"{spec}: {new}, {len(conversion.changes)} changes")
    else:
        print(file_writes.difference(change), end="")
    for line in conversion.notes:
        console.show(f"note: {line}", error=True)
    for line in conversion.by_hand:
        console.show(f"by hand: {line}", error=True)
    next_command.advise(*(("validate", spec) if write else ("mode convert", spec, *option, "--write")))


def _for_ros(document: Document, distro: str) -> Conversion:
    from swarmctl.mode_conversion.ros_conversion import for_distro
    from swarmctl.plugins import MIDDLEWARES
    from swarmctl.suggest import did_you_mean

    known = MIDDLEWARES.names()
    if distro not in known:
        console.fail(
            f"there is no ROS distribution `{distro}`",
            *did_you_mean(distro, known, "the distributions are"),
            code=exit_codes.USAGE,
        )
    made = for_distro(document, distro)
    before = set(_findings(document, document.source.text))
    new = [one for one in _findings(document, made.text) if one not in before]
    return replace(made, by_hand=tuple(f"{code}: {message}" for code, message in new))


def _findings(document: Document, text: str) -> list[tuple[str, str]]:
    """Code and message of all findings of a text of the spec."""
    from swarmctl.linter.runner import lint
    from swarmctl.spec.load import load_text

    result, found = load_text(text, document.source.path, document.catalog)
    return [(one.code, one.message) for one in (found if result is None else lint(result))]


def _converted(document: Document, to: str) -> Conversion:
    from swarmctl.mode_conversion.convert import converted
    from swarmctl.mode_conversion.infer import ArrangementError
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
    from swarmctl.mode_conversion.convert import converted
    from swarmctl.mode_conversion.infer import ArrangementError

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
            f"in another file, in a variable, or for only some elements of a range: {undone}",
            "make these changes by hand, or convert one file without ranges: `swarmctl spec --expanded`",
        ]
    result, found = load_text(conversion.text, document.source.path, document.catalog)
    found = found if result is None else lint(result)
    return [f"{one.code}: {one.message}" for one in found if one.severity is Severity.ERROR]


def _change(document: Document, conversion: Conversion) -> file_writes.Change:
    from swarmctl.yamltext.files import content

    source = document.source
    return file_writes.Change(content(Path(source.path)), source.path, source.text, conversion.text)
