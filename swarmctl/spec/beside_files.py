"""Files beside a spec that programs and robots get: read once, in a budget, and never followed outside."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

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
