"""``swarmctl schema``: the JSON Schema of a spec or of a robot type, for editors."""

from __future__ import annotations

from enum import Enum
from typing import Annotated

import typer

from swarmctl.cli import console


class Subject(str, Enum):
    SWARM = "swarm"
    ROBOT_TYPE = "robot-type"


def schema(
    subject: Annotated[Subject, typer.Argument(help="What the schema describes.")] = Subject.SWARM,
    markdown: Annotated[bool, typer.Option("--markdown", help="Print the reference page instead.")] = False,
) -> None:
    """Print a JSON Schema (draft-07): what may stand in a spec, or in a robot type's file.

    Editors check and complete a spec whose first line is: # yaml-language-server: $schema=FILE
    """
    from swarmctl.spec.reference import reference
    from swarmctl.spec.schema import schema_of

    if markdown:
        typer.echo(reference(subject.value), nl=False)
        return
    console.print_json(schema_of(subject.value))
