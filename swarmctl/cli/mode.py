"""``swarmctl mode``: which of the five modes a wiring is, and a spec rewritten into another."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import access, console, exits, rewriting

if TYPE_CHECKING:
    from swarmctl.spec.load import Document
    from swarmctl.topology.convert import Conversion

mode = typer.Typer(
    name="mode", no_args_is_help=True, help="Tell which of the five modes a wiring is, or change it."
)


@mode.command(epilog=exits.told())
def infer(spec: access.Spec, overlays: access.Overlays = None, json: access.Json = False) -> None:
    """Say which mode the wiring is, and what would make it the declared one. Exit code 1 if they differ."""
    from swarmctl.topology.infer import infer as inferred

    document = console.read_document(spec)
    found, declared = inferred(document.spec), document.spec.mode
    same = found.mode is declared
    edit = "" if same else rewriting.difference(_change(document, _converted(document, declared.value)))
    if json:
        told = {"mode": found.mode.value, "declared": declared.value, "hub": found.hub}
        console.print_json({"v": 1, **told, "because": list(found.because), "edit": edit})
    else:
        other = "" if same else f"; declared is {declared.value}"
        console.out().print(f"this is mode {found.mode.value}{other}")
        for line in found.because:
            console.out().print(f"  {line}")
        if edit:
            console.out().print(f"\nwhat would make it {declared.value}:\n\n{edit}", end="")
    raise typer.Exit(exits.OK if same else exits.ERROR)


@mode.command(epilog=exits.told())
def convert(
    spec: access.Spec,
    to: Annotated[str, typer.Option("--to", metavar="MODE", help="The mode to convert it to.")],
    write: Annotated[bool, typer.Option("--write", help="Change the file; else the edit is shown.")] = False,
) -> None:
    """Rewrite a spec into another mode with the smallest edit. Comments and layout stay."""
    document = console.read_document(spec)
    conversion = _converted(document, to)
    if found := _wrong(document, conversion):
        console.fail(f"{spec} cannot be converted to mode `{to}` by itself", *found)
    change = _change(document, conversion)
    if write:
        rewriting.write(change)
        console.err().print(f"{spec}: mode {to}, {len(conversion.changes)} changes")
    else:
        print(rewriting.difference(change), end="")
    for line in conversion.by_hand:
        console.err().print(f"by hand: {line}")


def _converted(document: Document, to: str) -> Conversion:
    from swarmctl.spec.model import Mode
    from swarmctl.spec.suggest import did_you_mean
    from swarmctl.topology.arrange import ArrangementError
    from swarmctl.topology.convert import converted

    known = [one.value for one in Mode]
    if to not in known:
        console.fail(f"there is no mode `{to}`", *did_you_mean(to, known, "the modes are"), code=exits.USAGE)
    try:
        return converted(document, Mode(to))
    except ArrangementError as error:
        console.fail(*error.args)


def _wrong(document: Document, conversion: Conversion) -> list[str]:
    """What keeps the new text from being the swarm that was asked for."""
    from swarmctl.checks.check import check
    from swarmctl.spec.diagnostics import Severity
    from swarmctl.spec.load import load_text

    if conversion.undone:
        return [
            f"this is not written in {document.source.path} itself: {'; '.join(conversion.undone)}",
            "`swarmctl spec --expanded` joins files and writes ranges out; convert what it prints",
        ]
    result, found = load_text(conversion.text, document.source.path, document.catalog)
    found = found if result is None else check(result)
    return [f"{one.code}: {one.message}" for one in found if one.severity is Severity.ERROR]


def _change(document: Document, conversion: Conversion) -> rewriting.Change:
    from swarmctl.spec.files import content

    source = document.source
    return rewriting.Change(content(Path(source.path)), source.path, source.text, conversion.text)
