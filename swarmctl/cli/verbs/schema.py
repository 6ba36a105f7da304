"""``swarmctl schema``: JSON Schemas of specs and robot types, of ``status --json`` and of capsules."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from pathlib import Path
from typing import Annotated, Any

import typer

from swarmctl.cli import console, exit_codes, file_writes


class Subject(str, Enum):
    """What the schema describes."""

    SWARM = "swarm"
    ROBOT_TYPE = "robot-type"
    STATUS = "status"
    CAPSULE = "capsule"


_OF_EDITORS = (Subject.SWARM, Subject.ROBOT_TYPE)


def schema(
    subject: Annotated[Subject, typer.Argument(help="What the schema describes.")] = Subject.SWARM,
    markdown: Annotated[bool, typer.Option("--markdown", help="Print the reference page instead.")] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            metavar="DIR",
            help="Write those of specs and robot types to this folder; older ones are replaced.",
        ),
    ] = None,
) -> None:
    """Print the JSON Schema of a spec or of a robot type (draft-07), of status --json or of a capsule.

    Editors check and complete a spec whose first line is: # yaml-language-server: $schema=FILE
    """
    if out is not None:
        _write(schema_files(out))
        return
    if subject not in _OF_EDITORS:
        if markdown:
            console.fail(f"there is no reference page of `{subject.value}`", code=exit_codes.USAGE)
        console.print_json(_of_output(subject))
        return
    from swarmctl.schema.json_schema import schema_of
    from swarmctl.schema.markdown import reference

    if markdown:
        typer.echo(reference(subject.value), nl=False)
        return
    console.print_json(schema_of(subject.value))


def _of_output(subject: Subject) -> Mapping[str, Any]:
    """The schema of what swarmctl itself prints or writes."""
    if subject is Subject.CAPSULE:
        from swarmctl.capsule.capsule_index import index_schema

        return index_schema()
    from swarmctl.health.swarm_health import status_schema

    return status_schema()


def schema_files(folder: Path) -> Mapping[Path, bytes]:
    """The schemas for editors, as files in a folder."""
    from swarmctl import resources

    shipped = (resources.schemas() / f"{one.value}.schema.json" for one in _OF_EDITORS)
    return {folder / file.name: file.read_bytes() for file in shipped}


def _write(files: Mapping[Path, bytes]) -> None:
    for path, content in files.items():
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            console.fail(console.cannot_write(error, path), "choose another folder for --out")
        file_writes.replace(path, content)
