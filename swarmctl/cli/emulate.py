"""``swarmctl emulate``: one emulated robot on a pty, for people who write drivers."""

from __future__ import annotations

import json as json_format
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import console, exits

if TYPE_CHECKING:
    from swarmctl.lab.emulators import Robot
    from swarmctl.lab.emulators.port import Port
    from swarmctl.lab.emulators.script import Step


def emulate(
    type_name: Annotated[
        str | None,
        typer.Argument(metavar="TYPE|FILE.py", help="The robot: see --list. Or a file of your own."),
    ] = None,
    *,
    link: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Make this a symbolic link to the port while it runs.")
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
        typer.Option(metavar="FILE", help="A timeline of faults, cables, walls: see docs/emulators.md."),
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="One JSON document a line.")] = False,
    seconds: Annotated[
        float | None,
        typer.Option(min=0.0, metavar="SECONDS", help="End after this time; else run until Ctrl-C."),
    ] = None,
    list_types: Annotated[
        bool, typer.Option("--list", help="List the robot types and what may be set.")
    ] = False,
) -> None:
    """Run one emulated robot on a pty: it answers as its manual says and moves as its wheels turn.

    The port's path comes first, then the pose: live on a terminal, elsewhere a line when the wheels change.
    """
    from swarmctl.cli.emulation import run
    from swarmctl.lab.emulators import TYPES
    from swarmctl.lab.emulators.own import OwnRobotError, blamed_on
    from swarmctl.lab.emulators.port import Port

    if list_types:
        _list_types(json)
        return
    port = Port(_robot(type_name, settings or []))
    _set_faults(port, fault or [])
    steps = _steps(script, port.robot) if script else ()
    own = type(port.robot) not in TYPES.values()
    try:
        with blamed_on(str(type_name), typer.Exit, KeyboardInterrupt) if own else nullcontext():
            run(port, link, steps, seconds, json=json)
    except OwnRobotError as error:
        console.fail(str(error))
    if port.failure:
        console.fail(port.failure)


def _list_types(json: bool) -> None:
    from swarmctl.lab.emulators import TYPES
    from swarmctl.lab.emulators.settings import settings_of

    found = [
        {"type": name, "title": _title(robot), "settings": list(settings_of(robot))}
        for name, robot in TYPES.items()
    ]
    if json:
        print(json_format.dumps(found))
        return
    for one in found:
        print(f"{one['type']:14}{one['title']}\n{'':14}--set {', '.join(one['settings'])}")


def _title(robot: type[Robot]) -> str:
    return (robot.__doc__ or "").splitlines()[0].replace("``", "`")


def _robot(type_name: str | None, texts: list[str]) -> Robot:
    from swarmctl.lab.emulators.own import OwnRobotError, built
    from swarmctl.lab.emulators.settings import parsed

    robot_type = _type(type_name)
    try:
        return built(robot_type, parsed(robot_type, texts))
    except OwnRobotError as error:
        console.fail(str(error))
    except ValueError as error:
        console.fail(f"{robot_type.type_name}: {error}", code=exits.USAGE)


def _type(name: str | None) -> type[Robot]:
    """The robot of that name, or of that file."""
    import difflib

    from swarmctl.lab.emulated import SAME_ROBOT
    from swarmctl.lab.emulators import TYPES
    from swarmctl.lab.emulators.own import OwnRobotError, load

    known = f"the types are {', '.join(TYPES)}"
    if name is None:
        console.fail("which robot?", f"swarmctl emulate TYPE; {known}", code=exits.USAGE)
    if name.endswith(".py"):
        try:
            return load(Path(name))
        except OwnRobotError as error:
            console.fail(str(error))
    name = SAME_ROBOT.get(name, name)
    if name not in TYPES:
        near = difflib.get_close_matches(name.lower(), TYPES, 1)
        meant = f"did you mean `{near[0]}`? " if near else ""
        console.fail(f"unknown robot type `{name}`", f"{meant}{known}", code=exits.USAGE)
    return TYPES[name]


def _set_faults(port: Port, texts: list[str]) -> None:
    from swarmctl.lab.emulators.faults import Faults

    try:
        port.faults = Faults.parse(texts)
    except ValueError as error:
        console.fail(str(error), "for example --fault delay=0.2 --fault drop=0.1", code=exits.USAGE)


def _steps(script: Path, robot: Robot) -> tuple[Step, ...]:
    from swarmctl.lab.emulators.script import read_script
    from swarmctl.spec.diagnostics import has_errors

    steps, found = read_script(script, robot)
    console.print_diagnostics(found)
    if has_errors(found):
        raise typer.Exit(exits.ERROR)
    return steps
