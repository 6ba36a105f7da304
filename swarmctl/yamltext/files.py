"""Reads files as UTF-8 text within the limits, or returns the error."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from swarmctl.diagnostics import Diagnostic, Span
from swarmctl.suggest import did_you_mean
from swarmctl.yamltext.limits import MAX_BYTES, MAX_FILES, LoadBudget

Read = Callable[[Path], bytes]


def content(path: Path) -> bytes:
    """Returns the bytes of a file, at most one above the limit: some devices never end."""
    with path.open("rb") as file:
        return file.read(MAX_BYTES + 1)


def text_of(path: Path, budget: LoadBudget, read: Read = content) -> str | Diagnostic:
    """Returns the text of a file without its byte order mark, or the error; takes it from ``budget``."""
    budget.files -= 1
    if budget.files < 0:
        return Diagnostic("FILE002", f"a spec has {MAX_FILES} files at most")
    try:
        found = read(path)
    except OSError as error:
        return _unreadable(path, error)
    budget.bytes -= len(found)
    if budget.bytes < 0:
        subject = f"`{path}` is" if len(found) > MAX_BYTES else f"`{path}` and the files before it are"
        return Diagnostic("FILE002", f"{subject} larger than {MAX_BYTES >> 20} MiB, the limit for a spec")
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
        f"the byte 0x{content[start]:02X} is not valid UTF-8",
        Span(name, line, column, line, column + 1),
        help=("save the file as UTF-8",),
    )
