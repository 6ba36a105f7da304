"""``swarmctl emulate``: runs one emulated robot on a pty, for driver development."""

from __future__ import annotations

import json as json_format
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import complete, console, exit_codes

if TYPE_CHECKING:
    from swarmctl.lab.emulators import Robot
    from swarmctl.lab.emulators.fault_script import Step
    from swarmctl.lab.emulators.serial_robot import Port


def emulate(
    type_name: Annotated[
        str | None,
        typer.Argument(
            metavar="TYPE|FILE.py",
            help="The robot type (see --list), or your own emulator.",
            autocompletion=complete.emulators,
        ),
    ] = None,
    *,
    link: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Create a symbolic link to the port here while it runs."),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set", metavar="NAME=VALUE", help="Repeatable: firmware=3, selector=5, battery=0.2 ..."
        ),
    ] = None,
    fault: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=VALUE", help="Repeatable: delay=0.2, drop=0.1, truncate=0.1, split=3 ..."),
    ] = None,
    script: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="A timeline of faults, cables and walls (see docs/emulators.md)."),
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print one JSON document per line.")] = False,
    seconds: Annotated[
        float | None,
        typer.Option(min=0.0, metavar="SECONDS", help="End after this time; by default run until Ctrl-C."),
    ] = None,
    list_types: Annotated[
        bool, typer.Option("--list", help="List the robot types and their settings.")
    ] = False,
) -> None:
    """Run one emulated robot on a pty. It replies as its manual specifies and simulates its motion.

    Prints the path of the port, then the pose: live on a terminal, elsewhere a line for each change of speed.
    """
    from swarmctl.cli.emulator_session import run
    from swarmctl.lab.emulators import TYPES
    from swarmctl.lab.emulators.serial_robot import Port
    from swarmctl.lab.emulators.user_robot import UserRobotError, user_code

    if list_types:
        _list_types(json)
        return
    port = Port(_robot(type_name, settings or []))
    _set_faults(port, fault or [])
    steps = _steps(script, port.robot) if script else ()
    own = type(port.robot) not in TYPES.values()
    try:
        with user_code(str(type_name), typer.Exit, KeyboardInterrupt) if own else nullcontext():
            run(port, link, steps, seconds, json=json)
    except UserRobotError as error:
        console.fail(str(error))
    if port.failure:
        console.fail(port.failure)


def _list_types(json: bool) -> None:
    from swarmctl.lab.emulators import TYPES
    from swarmctl.lab.emulators.emulator_settings import settings_of

    found = [
        {"type": name, "title": _title(robot), "settings": list(settings_of(robot))}
        for name, robot in TYPES.items()
    ]
    if json:
        print(json_format.dumps(found))
        return
    for one in found:
        console.show(f"{one['type']:14}{one['title']}")
        console.show(f"{'':14}--set {', '.join(one['settings'])}")


def _title(robot: type[Robot]) -> str:
    return (robot.__doc__ or "").splitlines()[0].replace("``", "`")


def _robot(type_name: str | None, texts: list[str]) -> Robot:
    from swarmctl.lab.emulators.emulator_settings import parsed
    from swarmctl.lab.emulators.user_robot import UserRobotError, build_user_robot

    robot_type = _type(type_name)
    try:
        return build_user_robot(robot_type, parsed(robot_type, texts))
    except UserRobotError as error:
        console.fail(str(error))
    except ValueError as error:
        console.fail(f"{robot_type.type_name}: {error}", code=exit_codes.USAGE)


def _type(name: str | None) -> type[Robot]:
    """The emulator of a robot type, or the one in a file."""
    import difflib

    from swarmctl.lab.emulators import TYPES
    from swarmctl.lab.emulators.emulator_lookup import EMULATED_AS
    from swarmctl.lab.emulators.user_robot import UserRobotError, load_robot_class

    known = f"the types are {', '.join(TYPES)}"
    if name is None:
        console.fail("the robot type is missing", f"swarmctl emulate TYPE; {known}", code=exit_codes.USAGE)
    if name.endswith(".py"):
        try:
            return load_robot_class(Path(name))
        except UserRobotError as error:
            console.fail(str(error))
    name = EMULATED_AS.get(name, name)
    if name not in TYPES:
        near = difflib.get_close_matches(name.lower(), TYPES, 1)
        meant = f"did you mean `{near[0]}`? " if near else ""
        console.fail(f"unknown robot type `{name}`", f"{meant}{known}", code=exit_codes.USAGE)
    return TYPES[name]


def _set_faults(port: Port, texts: list[str]) -> None:
    from swarmctl.lab.emulators.serial_faults import Faults

    try:
        port.faults = Faults.parse(texts)
    except ValueError as error:
        console.fail(str(error), "for example --fault delay=0.2 --fault drop=0.1", code=exit_codes.USAGE)


def _steps(script: Path, robot: Robot) -> tuple[Step, ...]:
    from swarmctl.diagnostics import has_errors
    from swarmctl.lab.emulators.fault_script import read_script

    steps, found = read_script(script, robot)
    console.print_diagnostics(found)
    if has_errors(found):
        raise typer.Exit(exit_codes.ERROR)
    return steps
