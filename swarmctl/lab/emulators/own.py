"""An emulator of one's own: the robot class in a Python file, and where that file went wrong."""

from __future__ import annotations

import importlib.util
import inspect
import os
import sys
import traceback
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from typing import Any

from swarmctl.lab.emulators.robot import Robot
from swarmctl.lab.emulators.settings import build, settings_of


class OwnRobotError(Exception):
    """A file of one's own that is no emulator; the text says why, in one line."""


def load(path: Path) -> type[Robot]:
    """The one class derived from ``Robot`` that ``path`` defines. Runs the file."""
    if not path.is_file():
        raise OwnRobotError(f"there is no file {path}")
    name = f"swarmctl_own_{path.stem}".replace("-", "_").replace(".", "_")
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise OwnRobotError(f"{path} is no Python file; its name ends with .py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look their module up
    with redirect_stdout(sys.stderr), blamed_on(path):
        spec.loader.exec_module(module)
    return _checked(path, [one for one in vars(module).values() if _is_robot_of(one, name)])


def _is_robot_of(thing: object, module: str) -> bool:
    return isinstance(thing, type) and issubclass(thing, Robot) and thing.__module__ == module


def _checked(path: Path, found: list[type[Robot]]) -> type[Robot]:
    if not found:
        raise OwnRobotError(f"{path} has no class derived from LineRobot (or Robot)")
    if len(found) > 1:
        names = ", ".join(one.__name__ for one in found)
        raise OwnRobotError(f"{path} has several robots, {names}; an emulator's file has one")
    robot = found[0]
    if inspect.isabstract(robot):
        lacking = ", ".join(f"`{name}`" for name in sorted(robot.__abstractmethods__))
        raise OwnRobotError(f"{place_of(robot)}: {robot.__name__} lacks the method {lacking}")
    if not hasattr(robot, "type_name"):
        robot.type_name = path.name.partition(".")[0]
    try:
        settings_of(robot)
    except BaseException as error:  # noqa: BLE001 (annotations are code of theirs)
        raise OwnRobotError(f"{place_of(robot)}: {robot.__name__}: {error}") from None
    return robot


def built(robot_type: type[Robot], settings: Mapping[str, Any]) -> Robot:
    """``build``, where what the constructor raises is told in one line. Wrong settings are ``ValueError``."""
    with redirect_stdout(sys.stderr), blamed_on(inspect.getfile(robot_type), ValueError):
        return build(robot_type, settings)


@contextmanager
def blamed_on(path: Path | str, *others: type[BaseException]) -> Iterator[None]:
    """Whatever the code of ``path`` raises, ``sys.exit()`` too, is an ``OwnRobotError``; but not ``others``.

    A copy of this process that it has forked ends here: there is one robot on one port.
    """
    process = os.getpid()
    try:
        yield
    except BaseException as error:
        if isinstance(error, (OwnRobotError, *others)):
            raise
        raise OwnRobotError(blame(error, path)) from None
    finally:
        if os.getpid() != process:
            os.write(2, f"error: {path}: it forks; the copy of this process ends\n".encode())
            os._exit(1)


def place_of(robot: type[Robot]) -> str:
    """Where the class begins, as file:line."""
    return f"{inspect.getfile(robot)}:{inspect.getsourcelines(robot)[1]}"


def blame(error: BaseException, path: Path | str) -> str:
    """``error`` in one line, with the line of ``path`` that it came through last."""
    if isinstance(error, SyntaxError) and error.filename == str(path):
        return f"{path}:{error.lineno}: {error.msg}"
    lines = [
        frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)
    ]
    where = f"{path}:{lines[-1]}" if lines else str(path)
    if isinstance(error, SystemExit):
        return f"{where}: SystemExit: it ends the whole program; a robot only answers, so take that out"
    return f"{where}: {type(error).__name__}: {error}".rstrip(": ")
