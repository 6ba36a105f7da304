"""Loads the user's emulator from a Python file and reports its errors with file and line."""

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

from swarmctl.lab.emulators.emulator_settings import build, settings_of
from swarmctl.lab.emulators.robot import Robot


class UserRobotError(Exception):
    """An emulator file that is wrong or failed; the text says why, in one line."""


def load_robot_class(path: Path) -> type[Robot]:
    """Runs the file and returns its one class derived from ``Robot``. Raises ``UserRobotError``."""
    if not path.is_file():
        raise UserRobotError(f"file not found: {path}")
    name = f"swarmctl_own_{path.stem}".replace("-", "_").replace(".", "_")
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise UserRobotError(f"{path} is not a Python file: its name must end with .py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look their module up
    with redirect_stdout(sys.stderr), user_code(path):
        spec.loader.exec_module(module)
    return _checked(path, [one for one in vars(module).values() if _is_robot_of(one, name)])


def _is_robot_of(thing: object, module: str) -> bool:
    return isinstance(thing, type) and issubclass(thing, Robot) and thing.__module__ == module


def _checked(path: Path, found: list[type[Robot]]) -> type[Robot]:
    if not found:
        raise UserRobotError(f"{path} needs a class derived from LineRobot (or Robot)")
    if len(found) > 1:
        names = ", ".join(one.__name__ for one in found)
        raise UserRobotError(f"{path} has several robots, {names}; keep one")
    robot = found[0]
    if inspect.isabstract(robot):
        lacking = ", ".join(f"`{name}`" for name in sorted(robot.__abstractmethods__))
        raise UserRobotError(f"{class_location(robot)}: {robot.__name__} needs the method {lacking}")
    if not hasattr(robot, "type_name"):
        robot.type_name = path.name.partition(".")[0]
    try:
        settings_of(robot)
    except BaseException as error:  # noqa: BLE001 (annotations are user code)
        raise UserRobotError(f"{class_location(robot)}: {robot.__name__}: {error}") from None
    return robot


def build_user_robot(robot_type: type[Robot], settings: Mapping[str, Any]) -> Robot:
    """Calls ``build``.

    Raises ``UserRobotError`` if the constructor fails, ``ValueError`` for wrong settings.
    """
    with redirect_stdout(sys.stderr), user_code(inspect.getfile(robot_type), ValueError):
        return build(robot_type, settings)


@contextmanager
def user_code(path: Path | str, *others: type[BaseException]) -> Iterator[None]:
    """Turns whatever the code of ``path`` raises, also ``sys.exit()``, into ``UserRobotError``, except
    ``others``.

    A process that it has forked ends here.
    """
    process = os.getpid()
    try:
        yield
    except BaseException as error:
        if isinstance(error, (UserRobotError, *others)):
            raise
        raise UserRobotError(describe_error(error, path)) from None
    finally:
        if os.getpid() != process:
            os.write(2, f"error: {path}: it called fork; the forked process ends\n".encode())
            os._exit(1)


def class_location(robot: type[Robot]) -> str:
    """Returns where the class is defined, as file:line."""
    return f"{inspect.getfile(robot)}:{inspect.getsourcelines(robot)[1]}"


def describe_error(error: BaseException, path: Path | str) -> str:
    """Returns ``error`` in one line, with the last line of ``path`` in its traceback."""
    if isinstance(error, SyntaxError) and error.filename == str(path):
        return f"{path}:{error.lineno}: {error.msg}"
    lines = [
        frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)
    ]
    where = f"{path}:{lines[-1]}" if lines else str(path)
    if isinstance(error, SystemExit):
        return f"{where}: SystemExit: it would end the whole program; remove the exit"
    return f"{where}: {type(error).__name__}: {error}".rstrip(": ")
