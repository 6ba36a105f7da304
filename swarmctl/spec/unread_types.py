"""Files that are meant as robot types, and that nothing reads: another ending, folder or kind of name."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from os.path import realpath
from pathlib import Path

from swarmctl.diagnostics import Diagnostic
from swarmctl.field_types import ROBOT_TYPE_NAME
from swarmctl.yamltext.limits import MAX_FINDINGS
from swarmctl.yamltext.project_files import ProjectFiles

_FOLDERS = frozenset({"robot", "robots", "robot-types", "robot_types", "robottypes", "types"})
_TYPE_FILE = re.compile(r"(?P<stem>.+)\.ya?ml", re.IGNORECASE)
_READ = re.compile(rf"{ROBOT_TYPE_NAME.rstrip('$')}\.yaml", re.ASCII)


def can_be_named(file: str) -> bool:
    """True for the name of a file whose robot type a spec can name."""
    return _READ.fullmatch(file) is not None


def unread_types(folder: Path, files: ProjectFiles, others: Collection[str]) -> Mapping[str, Path]:
    """Returns the files that seem to be robot types and are not read, by the name that a spec would give.

    ``folder`` is the one in which types are; ``others`` are real paths of files that are something else.
    """
    found: dict[str, Path] = {}
    for place in (folder, *_folders_like(folder, files)):
        for name in files.names(place):
            written = _TYPE_FILE.fullmatch(name)
            if written is None or (place == folder and can_be_named(name)):
                continue
            if realpath(place / name) not in others:
                found.setdefault(written["stem"].lower(), place / name)
    return found


def _folders_like(folder: Path, files: ProjectFiles) -> Iterator[Path]:
    for name in files.names(folder.parent):
        if name != folder.name and name.lower() in _FOLDERS:
            yield folder.parent / name


def warnings(folder: Path, unread: Mapping[str, Path]) -> Iterator[Diagnostic]:
    """Yields a warning for each unread file in ``folder`` itself: it can hardly be anything else."""
    inside = [(stem, file) for stem, file in unread.items() if file.parent == folder]
    for stem, file in inside[:MAX_FINDINGS]:
        yield Diagnostic(
            "FILE005",
            f"`{file}` is not read as a robot type",
            help=(advice(folder, stem),),
        )


def advice(folder: Path, stem: str) -> str:
    """How a file has to be called whose robot type is to be ``stem``."""
    name = f"{stem}.yaml"
    if can_be_named(name):
        return f"rename it to `{folder / name}`"
    return (
        "give it a name of lower-case letters, digits, dots and hyphens, a letter first, ending with `.yaml`"
    )
