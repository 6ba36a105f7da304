"""Files to text: as UTF-8, within the limits, or the reason why not."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from swarmctl.spec.diagnostics import Diagnostic, Span
from swarmctl.spec.limits import MAX_BYTES, MAX_FILES, Room
from swarmctl.spec.suggest import did_you_mean

Read = Callable[[Path], bytes]


def content(path: Path) -> bytes:
    """What stands in a file, no more than a little above the limit: some devices have no end."""
    with path.open("rb") as file:
        return file.read(MAX_BYTES + 1)


def text_of(path: Path, room: Room, read: Read = content) -> str | Diagnostic:
    """The text of a file without its byte order mark, as far as there is ``room``."""
    room.files -= 1
    if room.files < 0:
        return Diagnostic("FILE002", f"these are more than {MAX_FILES} files; that is no spec")
    try:
        found = read(path)
    except OSError as error:
        return _unreadable(path, error)
    room.bytes -= len(found)
    if room.bytes < 0:
        told = f"`{path}` is" if len(found) > MAX_BYTES else f"`{path}` and the files before it are"
        return Diagnostic("FILE002", f"{told} larger than {MAX_BYTES >> 20} MiB; that is no spec")
    try:
        return found.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        return _not_utf8(str(path), found, error.start)


def _unreadable(path: Path, error: OSError) -> Diagnostic:
    if isinstance(error, IsADirectoryError):
        inside = sorted(one.name for one in path.glob("*.yaml"))
        help_ = (f"did you mean `{path / inside[0]}`?",) if inside else ("name the YAML file in it",)
        return Diagnostic("FILE001", f"`{path}` is a folder, not a spec", help=help_)
    if isinstance(error, FileNotFoundError):
        near = did_you_mean(
            path.name, [one.name for one in path.parent.glob("*.yaml")], "YAML files in that folder"
        )
        return Diagnostic("FILE001", f"there is no file `{path}`", help=near)
    return Diagnostic("FILE001", f"cannot read `{path}`: {error.strerror or error}")


def _not_utf8(name: str, content: bytes, start: int) -> Diagnostic:
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return Diagnostic(
            "FILE003", f"`{name}` is UTF-16", Span(name, 1, 1, 1, 1), help=("save the file as UTF-8",)
        )
    before = content[:start].decode("utf-8-sig").splitlines() or [""]
    if content[:start].endswith((b"\n", b"\r")):
        before.append("")
    line, column = len(before), len(before[-1]) + 1
    return Diagnostic(
        "FILE003",
        f"the byte 0x{content[start]:02X} makes no character in UTF-8",
        Span(name, line, column, line, column + 1),
        help=("save the file as UTF-8",),
    )
