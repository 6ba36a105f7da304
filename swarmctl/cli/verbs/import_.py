"""``swarmctl import``: drafts a spec from the files of a lab, or shows what they have and a spec has not."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import console, exit_codes, file_writes
from swarmctl.cli.spec_args import SpecFiles

if TYPE_CHECKING:
    from swarmctl.importing.drafting import Kind


def import_(
    path: Annotated[
        Path, typer.Argument(metavar="PATH", help="The folder or the file to import.", show_default=False)
    ],
    kind: Annotated[
        str,
        typer.Option(
            "--from",
            metavar="KIND",
            help="launch, ros2, ansible or clearpath; by default what the files contain.",
        ),
    ] = "",
    out: Annotated[
        Path | None, typer.Option("--out", "-o", metavar="FILE", help="Write the draft to a file.")
    ] = None,
    onto: Annotated[
        Path | None,
        typer.Option("--onto", metavar="SPEC", help="Show only what a spec has not, and write nothing."),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite FILE.")] = False,
) -> None:
    """Draft a spec from launch files, scripts, Compose files, an Ansible inventory or a robot.yaml.

    A comment at each value names the line that it comes from, or why it is a guess. Secrets are left out.
    """
    from swarmctl.importing.drafting import DraftError, compared, imported

    if onto is not None and out is not None:
        console.fail("--onto writes nothing; leave out --out", code=exit_codes.USAGE)
    spec = out or Path("swarm.yaml")
    if out is not None and out.exists() and not force:
        console.fail(f"{out} exists already", "choose another file, or use --force to overwrite it")
    try:
        if onto is None:
            found = imported(path, _kind(kind), spec)
        else:
            document = console.read_document(SpecFiles((onto,)))
            found = compared(path, _kind(kind), document, onto)
    except DraftError as error:
        problem, *help_lines = error.args
        console.fail(problem, *help_lines)
    if onto is not None:
        print(found.text or f"{onto} has all that is read of {path}\n", end="", flush=True)
        if found.summary:
            console.err().print(f"{found.summary}: swarmctl import {path} lists it")
        return
    validate = SpecFiles((spec,)).command("validate")
    if out is None:
        print(found.text, end="", flush=True)
        console.err().print(found.summary)
        console.err().print(f"write it with --out {spec}, then run: {validate}")
    else:
        file_writes.replace(out, found.text.encode())
        console.err().print(f"{out}: {found.summary}")
        console.err().print(f"complete it, then run: {validate}")


def _kind(word: str) -> Kind | None:
    from swarmctl.importing.drafting import Kind
    from swarmctl.suggest import did_you_mean

    kinds = [one.value for one in Kind]
    if word and word not in kinds:
        console.fail(
            f"there is no kind `{word}`", *did_you_mean(word, kinds, "the kinds are"), code=exit_codes.USAGE
        )
    return Kind(word) if word else None
