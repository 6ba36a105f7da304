"""``swarmctl migrate``: rewrites a spec of an older version of the format."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from swarmctl.cli import console, exit_codes, file_writes, next_command, options


def migrate(
    spec: options.Spec,
    overlays: options.Overlays = None,
    to: Annotated[
        int | None,
        typer.Option("--to", metavar="VERSION", help="The new version; by default the current one."),
    ] = None,
    write: Annotated[
        bool, typer.Option("--write", help="Write the files; by default the edit is only shown.")
    ] = False,
) -> None:
    """Migrate a spec to a newer version of the format. Comments and layout stay."""
    from functools import cache

    from swarmctl.migration.migrate import UnreadableError, migrated
    from swarmctl.migration.versions import SPEC_VERSIONS
    from swarmctl.yamltext.files import content

    newest = SPEC_VERSIONS.current
    wanted = newest if to is None else to
    oldest = min((newest, *SPEC_VERSIONS.steps_from))
    if not oldest <= wanted <= newest:
        known = f"{oldest} to {newest}" if oldest < newest else str(newest)
        console.fail(f"--to {wanted}: this swarmctl knows version {known}", code=exit_codes.USAGE)
    read = cache(content)
    try:
        found = migrated(spec.files, read, wanted, SPEC_VERSIONS)
    except UnreadableError as error:
        console.print_diagnostics(error.found)
        raise typer.Exit(exit_codes.ERROR) from None
    if found.version is None:
        way = f"write `version: {newest}` if it is a new spec, then `swarmctl validate {spec.first}`"
        console.fail(f"{spec} declares no version of the format that this swarmctl knows", way)
    if found.version > wanted:
        newer = f"{spec}: version {found.version} of the spec format is newer than "
        console.fail(newer + ("this swarmctl" if found.version > newest else f"version {wanted}"))
    if found.undone:
        console.fail(
            f"{spec} cannot be migrated automatically, and nothing was written",
            *(f"{span}: {why}" for span, why in found.undone),
            "correct these places, write out what a range or an alias writes, and migrate again",
        )
    changes = [
        file_writes.Change(read(Path(file)), file, read(Path(file)).decode("utf-8-sig"), text)
        for file, text in found.texts.items()
    ]
    if write:
        file_writes.write(changes)
    for change in changes if not write else ():
        print(file_writes.difference(change), end="")
    for line in found.notes:
        console.err().print(f"note: {line}", markup=False)
    done = "is now of" if write and changes else "would be of" if changes else "is already of"
    console.err().print(f"{spec}: {done} version {wanted}")
    next_command.advise(*(("migrate", spec, "--write") if changes and not write else ("validate", spec)))
