"""Files beside a spec that programs and robots get: read once, in a budget, and never followed outside."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from os.path import realpath
from pathlib import Path

from swarmctl.diagnostics import Diagnostic
from swarmctl.field_types import ROBOT_TYPE_NAME
from swarmctl.yamltext.files import MAX_FINDINGS
from swarmctl.yamltext.project_files import ProjectFiles

MAX_FILE_BYTES = 4 << 20
MAX_BYTES = 16 << 20  # of all files together: a release is sent to hosts over their wlan
ABSENT = "does not exist"
_ANY_SUFFIX = ("",)


@dataclass(frozen=True)
class BesideFiles:
    """The content of files by their path from the spec's folder, and why others cannot be read."""

    content: Mapping[str, bytes] = field(default_factory=dict)
    refused: Mapping[str, str] = field(default_factory=dict)


NO_FILES = BesideFiles()


def read_beside(folder: Path, paths: Iterable[str], files: ProjectFiles) -> BesideFiles:
    """Reads ``paths`` below the ``folder`` of a spec."""
    content: dict[str, bytes] = {}
    refused: dict[str, str] = {}
    left = MAX_BYTES
    for path in dict.fromkeys(paths):
        found = _read(folder / path, files)
        if isinstance(found, str):
            refused[path] = found
        elif len(found) > min(left, MAX_FILE_BYTES):
            most = "one file beside a spec" if len(found) > MAX_FILE_BYTES else "all of them together"
            limit = MAX_FILE_BYTES if len(found) > MAX_FILE_BYTES else MAX_BYTES
            refused[path] = f"is larger than {limit >> 20} MiB, the limit for {most}"
        else:
            left -= len(found)
            content[path] = found
    return BesideFiles(content, refused)


def _read(path: Path, files: ProjectFiles) -> bytes | str:
    """The content of a file, or why it cannot be read."""
    if reason := files.refusal(path, _ANY_SUFFIX):
        return reason
    try:
        return files.read(path)
    except FileNotFoundError:
        return ABSENT
    except IsADirectoryError:
        return "is a folder; name each file in it"
    except OSError as error:
        return f"cannot be read: {error.strerror or error}"


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
