"""The one way from a spec to the files that it draws in, so that a foreign spec reads nothing else.

A file is part of a spec if it lies in the spec's folder, is not hidden and ends with ``.yaml``, and if all
of them together keep one budget. What links lead to counts, not what they are called.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from swarmctl.diagnostics import Diagnostic, Span
from swarmctl.suggest import did_you_mean
from swarmctl.yamltext.files import Read, content, is_stream
from swarmctl.yamltext.limits import MAX_BYTES, MAX_ENTRIES, MAX_FILES, LoadBudget

_USUAL = "swarm.yaml"  # of several files, the one that verbs take if none is named
SUFFIXES = (".yaml", ".yml")
OUTSIDE = "lies outside the spec's folder"
HIDDEN = "is hidden, or a link to a hidden file"
OTHER_SUFFIX = "does not end with `.yaml`, or is a link to such a file"


@dataclass(frozen=True)
class ProjectFiles:
    """The files in the folder of one spec, or of a file laid over it."""

    root: str | None  # the real path of the folder; None: nothing lies beside the spec
    budget: LoadBudget
    read: Read = content

    @classmethod
    def beside(cls, spec: Path, budget: LoadBudget, read: Read = content) -> ProjectFiles:
        """The files beside ``spec``; beside a pipe there are none."""
        return cls(None if is_stream(spec) else os.path.realpath(spec.parent), budget, read)

    def refusal(self, path: Path, suffixes: tuple[str, ...] = SUFFIXES) -> str:
        """Says why a file or folder is no part of the spec; empty if it is."""
        real = Path(os.path.realpath(path))
        if self.root is None or not real.is_relative_to(self.root):
            return OUTSIDE
        if any(part.startswith(".") for part in real.relative_to(self.root).parts):
            return HIDDEN
        is_part = real.name.endswith(suffixes) or os.path.isdir(real)  # noqa: PTH112  any length of a name
        return "" if is_part else OTHER_SUFFIX

    def named(self, path: Path) -> str | Diagnostic:
        """Returns the text of a file that the command line names: any file, but no link to another folder."""
        if path.is_symlink() and not is_stream(path) and self.refusal(path):
            return link_error(path, "name the file itself")
        return self._text(path)

    def text(self, path: Path, suffixes: tuple[str, ...] = SUFFIXES) -> str | Diagnostic:
        """Returns the text of a file beside the spec without its byte order mark, or the error."""
        if self.refusal(path, suffixes):
            return link_error(path)
        return self._text(path)

    def _text(self, path: Path) -> str | Diagnostic:
        budget = self.budget
        budget.files -= 1
        if budget.files < 0:
            return Diagnostic("FILE002", f"a spec has {MAX_FILES} files at most")
        try:
            found = self.read(path)
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

    @property
    def exhausted(self) -> bool:
        """True if no file may be read any more."""
        return min(self.budget.files, self.budget.bytes, self.budget.nodes) < 0

    def names(self, folder: Path) -> list[str]:
        """Returns the names in a folder of the spec, sorted; hidden ones are left out."""
        if self.refusal(folder):
            return []
        try:
            with os.scandir(folder) as entries:
                return sorted(one.name for one in islice(entries, MAX_ENTRIES) if one.name[0] != ".")
        except OSError:
            return []


def link_error(
    path: Path, help_: str = "replace it by what it leads to; nothing elsewhere is read"
) -> Diagnostic:
    """The error about a link to what is no part of the spec."""
    return Diagnostic("FILE004", f"`{path}` is a link to what is no part of the spec", help=(help_,))


def _unreadable(path: Path, error: OSError) -> Diagnostic:
    if isinstance(error, IsADirectoryError):
        inside = sorted(path.glob("*.yaml"), key=lambda one: (one.name != _USUAL, one.name))
        help_ = (f"did you mean `{inside[0]}`?",) if inside else ("name the YAML file in it",)
        return Diagnostic("FILE001", f"`{path}` is a folder, not a spec", help=help_)
    if isinstance(error, FileNotFoundError):
        beside = [one.name for one in path.parent.glob("*.yaml") if one.name != path.name]  # it is a link
        near = did_you_mean(path.name, beside, "YAML files in that folder")
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
