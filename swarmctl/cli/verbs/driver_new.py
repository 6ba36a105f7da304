"""``swarmctl driver new``: writes the files that begin a user's own robot type."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from swarmctl.cli import console, exit_codes, file_writes
from swarmctl.cli.verbs.driver_types import Folder


def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="The new type's name, such as beetle.")],
    protocol: Annotated[
        str,
        typer.Option(
            "--protocol",
            metavar="KIND",
            help="line (text), binary, python (a class of your own) or rosserial.",
        ),
    ] = "line",
    folder: Folder = Path(),
) -> None:
    """Write a commented robot type to DIR/robots/NAME.yaml; with --protocol python also a codec to NAME.py.

    Values that only you know are empty: `driver show NAME` lists them, `driver test NAME` tries the type.
    """
    from swarmctl.robot_types.protocols import PROTOCOLS
    from swarmctl.scaffold import robot_type_file
    from swarmctl.suggest import did_you_mean

    _check_name(name)
    if protocol not in PROTOCOLS:
        console.fail(
            f"there is no protocol kind `{protocol}`",
            *did_you_mean(protocol, PROTOCOLS, "the kinds are"),
            code=exit_codes.USAGE,
        )
    file = folder / "robots" / f"{name}.yaml"
    with _readable_errors(file):
        for path in (file, file.with_suffix(".py")):
            if path.exists():
                console.fail(f"{path} exists already", "choose another name, or remove the file first")
        schema = (folder / ".swarmctl").is_dir()
        files = {file: robot_type_file.type_text(name, protocol, schema=schema)}
        if protocol == "python":
            files[file.with_suffix(".py")] = robot_type_file.codec_text(name)
        for path, text in files.items():
            file_writes.create(path, text.encode())
    for path in files:
        console.out().print(f"{path}: written")
    at = "" if folder == Path() else f" --dir {folder}"
    console.out().print(f"fill in its empty values; this lists them: swarmctl driver show {name}{at}")


def _check_name(name: str) -> None:
    from swarmctl.field_types import ROBOT_TYPE_NAME

    if not re.fullmatch(ROBOT_TYPE_NAME, name, re.ASCII) or name.endswith("\n"):
        console.fail(
            f"`{name}` cannot be the name of a robot type",
            "use lower-case letters, digits, dots and hyphens, a letter first, 31 at most",
            code=exit_codes.USAGE,
        )


@contextmanager
def _readable_errors(file: Path) -> Iterator[None]:
    """Ends the program with the file's name and the reason where the operating system refuses an access."""
    try:
        yield
    except OSError as error:
        console.fail(console.cannot_write(error, file), "choose another --dir")
