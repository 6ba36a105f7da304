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
            help="line (text), binary, python (a class of your own) or rosserial.  [default: line]",
            show_default=False,
        ),
    ] = "",
    driver: Annotated[
        str,
        typer.Option(
            "--driver",
            metavar="PACKAGE/FILE",
            help="An executable or launch file of a ROS package drives the robot: rosaria/RosAria.",
            show_default=False,
        ),
    ] = "",
    folder: Folder = Path(),
) -> None:
    """Write a commented robot type to DIR/robots/NAME.yaml; with --protocol python also a codec to NAME.py.

    Values that only you know are empty: `driver show NAME` lists them, `driver test NAME` tries a protocol.
    """
    from swarmctl.robot_types.protocols import PROTOCOLS
    from swarmctl.scaffold import starting_files
    from swarmctl.suggest import did_you_mean

    _check_name(name)
    if protocol and driver:
        console.fail("--protocol and --driver exclude each other", code=exit_codes.USAGE)
    protocol = protocol or "line"
    package, file_name = _driver(driver) if driver else ("", "")
    if protocol not in PROTOCOLS:
        console.fail(
            f"there is no protocol kind `{protocol}`",
            *did_you_mean(protocol, PROTOCOLS, "the kinds are"),
            "for a driver that is a ROS package: --driver PACKAGE/FILE",
            code=exit_codes.USAGE,
        )
    file = folder / "robots" / f"{name}.yaml"
    with _readable_errors(file):
        for path in (file, file.with_suffix(".py")):
            if path.exists():
                console.fail(f"{path} exists already", "choose another name, or remove the file first")
        schema = (folder / ".swarmctl").is_dir()
        if driver:
            files = {file: starting_files.ros_type_text(name, package, file_name, schema=schema)}
        else:
            files = {file: starting_files.type_text(name, protocol, schema=schema)}
        if protocol == "python":
            files[file.with_suffix(".py")] = starting_files.codec_text(name)
        for path, text in files.items():
            file_writes.create(path, text.encode())
    for path in files:
        console.out().print(f"{path}: written")
    at = "" if folder == Path() else f" --dir {folder}"
    console.out().print(f"fill in its empty values; this lists them: swarmctl driver show {name}{at}")


def _driver(text: str) -> tuple[str, str]:
    """The package of ``--driver``, and its executable or launch file; the folder `launch` may be named."""
    from pydantic import TypeAdapter, ValidationError

    from swarmctl.field_types import LaunchFile, PackageName

    package, _, file = text.partition("/")
    file = file.removeprefix("launch/")
    try:
        TypeAdapter(PackageName).validate_python(package)
        TypeAdapter(LaunchFile).validate_python(file)
    except ValidationError:
        console.fail(
            f"--driver: `{text}` does not name a file of a ROS package",
            "write PACKAGE/EXECUTABLE or PACKAGE/FILE.launch, such as rosaria/RosAria",
            code=exit_codes.USAGE,
        )
    return package, file


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
