"""Runs catkin's tools in the ROS of the host, keeps their output, and finds the first error in it."""

from __future__ import annotations

import contextlib
import glob
import os
import pwd
import re

from . import command, disk, packages
from .errors import FailedError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Callable, Iterable, Iterator, Mapping, Sequence, TextIO

LONGEST = 7200.0  # s
_FULL = "No space left on device"  # as most compilers and linkers write it
_LITTLE = 4 << 20  # bytes; a disk with less is full, whatever the tools write about it
_MOST_LINES = 100_000  # of one log
_MEMORY_OF_A_COMPILER = 1 << 30  # bytes; roscpp with its templates takes about that
#: As the setup files of /opt/ros set them; Debian's ROS has none, and catkin orders packages by them.
_ROS1 = {"ROS_VERSION": "1", "ROS_PYTHON_VERSION": "3"}
#: Sources the setup files, each upon those before, then becomes the program.
_WITH_ROS = (
    'use() { setup=$1; shift; . "$setup"; }; extend=; '
    'for one in $SETUPS; do use "$one" $extend; extend=--extend; done; exec "$@"'
)
_PERCENT = re.compile(r"^\[ *\d+%\] (.*)")
_PACKAGE = re.compile(r"^==> Processing (?:catkin|plain cmake) package: '([^']+)'")
_COMPILER = re.compile(r"^(/[^:]+:\d+(?::\d+)?): (?:fatal )?error: (.*)")
_CMAKE = re.compile(r"^CMake Error at ([^ ]+\.(?:txt|cmake|in)):(\d+)")
_LINKER = re.compile(r"^(?:/\S*ld: )?([^\s:]+):.*(undefined reference to .*)")
_OTHERS = re.compile(r"^(?:\S*(?:Error|InvalidMsgSpec|MsgNotFound): .*|Error\(s\) in package .*)")


def setup_files(spaces: Iterable[str], outside: Callable[[str], str]) -> list[str]:
    """Returns the setup files of ROS and of the built workspaces, of which the first hides the others."""
    system = sorted(glob.glob(outside("/opt/ros/*/setup.sh")))[:1]
    built = [place for path in spaces for place in [packages.space(path, outside)] if place]
    return [*system, *(outside(f"{place}/setup.sh") for place in reversed(built))]


def run(
    argv: Sequence[str],
    what: str,
    *,
    owner: pwd.struct_passwd,
    setups: Sequence[str],
    log: str,
    note: Callable[[str], None],
    shown: Mapping[str, str] = {},
) -> None:
    """Runs a tool of catkin as ``owner``; its output goes to the file ``log``.

    ``shown``: folders of the host, and what an error calls them. Raises ``FailedError`` with the first error.
    """
    inner = ["sh", "-c", _WITH_ROS, "sh", *argv]
    whole = inner if owner.pw_uid == 0 else ["runuser", "-u", owner.pw_name, "--", *inner]
    lines: list[str] = []

    def progress(line: str) -> None:
        if len(lines) < _MOST_LINES:
            lines.append(line)
            with contextlib.suppress(OSError):  # the disk is full: the build ends by that soon
                file.write(line + "\n")
        done = _PERCENT.match(line) or _PACKAGE.match(line)
        if done is not None:
            note(done.group(1)[:150])

    env = {**_ROS1, "HOME": owner.pw_dir, "SETUPS": " ".join(setups), "PYTHONDONTWRITEBYTECODE": "1"}
    with _log(log) as file:
        try:
            command.run(whole, what, timeout=LONGEST, line=progress, env=env)
        except FailedError as error:
            folder = os.path.dirname(log)
            if any(_FULL in line for line in lines) or disk.free(folder) < _LITTLE:
                raise disk.full(folder, what) from error
            found = first_error(lines)
            if not found:
                raise
            for folder, name in shown.items():
                found = found.replace(folder, name)
            raise FailedError(f"{what} failed: {found}"[:1500], f"the whole output is in {log}") from error


@contextlib.contextmanager
def _log(path: str) -> Iterator[TextIO]:
    """Opens the log; what a full disk does not take of it is lost."""
    file = open(path, "w", encoding="utf-8")  # noqa: SIM115  (closed below)
    try:
        yield file
    finally:
        with contextlib.suppress(OSError):
            file.close()


def first_error(lines: Sequence[str]) -> str:
    """Returns the first error with its file and line; empty if there is none that is known."""
    for number, line in enumerate(lines):
        match = _COMPILER.match(line)
        if match is not None:
            return f"{match.group(1)}: {match.group(2)}"
        match = _CMAKE.match(line)
        if match is not None:
            return f"{match.group(1)}:{match.group(2)}: {_message(lines[number + 1 :])}"
        match = _LINKER.match(line)
        if match is not None:
            return f"{match.group(1)}: {match.group(2)}"
        if _OTHERS.match(line):
            return line if not line.startswith("Error(s)") else f"{line} {_message(lines[number + 1 :])}"
    return ""


def _message(lines: Sequence[str]) -> str:
    """The first lines of a message, up to an empty one or the call stack."""
    found: list[str] = []
    for line in lines[:6]:
        if line.startswith(("Call Stack", "-- ")) or (found and not line.strip()):
            break
        found.append(line.strip())
    return " ".join(one for one in found if one)


def jobs() -> int:
    """Returns how many compilers fit into the memory at the same time."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    return max(1, min(os.cpu_count() or 1, memory // _MEMORY_OF_A_COMPILER))
