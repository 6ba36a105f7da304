"""``swarmctl emulate``: one emulated robot on a pty, for people who write drivers."""

from __future__ import annotations

import json as json_format
import math
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from swarmctl.cli import console, exits

if TYPE_CHECKING:
    from swarmctl.lab.emulators import Robot
    from swarmctl.lab.emulators.port import Port, Snapshot

LOOK_EVERY = 0.05  # s
PLUG_AGAIN_AFTER = 2.0  # s, once a fault has pulled the cable


def emulate(
    type_name: Annotated[str | None, typer.Argument(metavar="TYPE", help="The robot: see --list.")] = None,
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
    from swarmctl.lab.emulators.port import Port

    if list_types:
        _list_types(json)
        return
    port = Port(_robot(type_name, settings or []))
    _set_faults(port, fault or [])
    with _ended_by_signals(), port, _Link(link) as shown:
        report = _Report(json=json, live=sys.stdout.isatty() and not json)
        try:
            _watch(port, shown, report, seconds)
        except KeyboardInterrupt:
            report.end(port.snapshot())


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
    import difflib

    from swarmctl.lab.emulators import TYPES
    from swarmctl.lab.emulators.settings import build, parsed

    known = f"the types are {', '.join(TYPES)}"
    if type_name is None:
        console.fail("which robot?", f"swarmctl emulate TYPE; {known}", code=exits.USAGE)
    if type_name not in TYPES:
        near = difflib.get_close_matches(type_name.lower(), TYPES, 1)
        meant = f"did you mean `{near[0]}`? " if near else ""
        console.fail(f"unknown robot type `{type_name}`", f"{meant}{known}", code=exits.USAGE)
    try:
        return build(TYPES[type_name], parsed(TYPES[type_name], texts))
    except ValueError as error:
        console.fail(f"a {type_name}: {error}", code=exits.USAGE)


def _set_faults(port: Port, texts: list[str]) -> None:
    from swarmctl.lab.emulators.faults import Faults

    try:
        port.faults = Faults.parse(texts)
    except ValueError as error:
        console.fail(str(error), "for example --fault delay=0.2 --fault drop=0.1", code=exits.USAGE)


@contextmanager
def _ended_by_signals() -> Iterator[None]:
    """Let a terminating signal end the robot as Ctrl-C does, so that its link is taken away."""

    def interrupt(*_: Any) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


class _Link:
    """A symbolic link to the port, for as long as the robot runs. Without a path it does nothing."""

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self._target: Path | None = None
        if path is not None and path.exists() and not path.is_symlink():
            console.fail(f"{path} exists and is not a symbolic link", "choose another --link, or remove it")

    def show(self, target: Path) -> None:
        if self._path is None:
            return
        try:
            self._path.unlink(missing_ok=True)
            self._path.symlink_to(target)
        except OSError as error:
            console.fail(f"cannot make the link {self._path}: {error.strerror}", "choose another --link")
        self._target = target

    def __enter__(self) -> _Link:
        return self

    def __exit__(self, *_: object) -> None:
        if self._path is not None and self._target is not None:
            with suppress(OSError):
                if self._path.readlink() == self._target:
                    self._path.unlink()


class _Report:
    """Prints where the robot is: one live line, or a line whenever its wheels change."""

    def __init__(self, *, json: bool, live: bool) -> None:
        self._json = json
        self._live = live
        self._began = time.monotonic()
        self._wheels = (0.0, 0.0)
        self._shown_at: float | None = None

    def port(self, path: Path) -> None:
        print(json_format.dumps({"port": str(path)}) if self._json else path, flush=True)

    def state(self, snapshot: Snapshot) -> None:
        wheels = (snapshot.left, snapshot.right)
        if self._live:
            print(f"\r{self._line(snapshot)}\x1b[K", end="", flush=True)
        elif wheels != self._wheels:
            self._shown_at = snapshot.distance  # before the line is out: an interrupt may be the answer to it
            print(self._line(snapshot), flush=True)
        self._wheels = wheels

    def end(self, snapshot: Snapshot) -> None:
        """The last word: where the robot came to be, unless that stands there already."""
        if self._live:
            print(f"\r{self._line(snapshot)}\x1b[K", flush=True)
        elif self._shown_at is not None and self._shown_at != snapshot.distance:
            print(self._line(snapshot), flush=True)

    def _line(self, snapshot: Snapshot) -> str:
        since = time.monotonic() - self._began
        if self._json:
            return json_format.dumps({"time": round(since, 3), **asdict(snapshot)})
        return (
            f"{since:8.2f} s  x {snapshot.x:+.3f} m  y {snapshot.y:+.3f} m  "
            f"theta {math.degrees(snapshot.theta):+.1f} deg  "
            f"wheels {snapshot.left:+.4f} {snapshot.right:+.4f} m/s  {snapshot.last_command!r}"
        )


def _watch(port: Port, link: _Link, report: _Report, seconds: float | None) -> None:
    end = math.inf if seconds is None else time.monotonic() + seconds
    path = port.plug()
    link.show(path)
    report.port(path)
    while (now := time.monotonic()) < end:
        snapshot = port.snapshot()
        report.state(snapshot)
        if snapshot.plugged:
            time.sleep(min(LOOK_EVERY, end - now))
        else:
            time.sleep(min(PLUG_AGAIN_AFTER, end - now))
            path = port.plug()
            link.show(path)
            report.port(path)
    report.end(port.snapshot())
