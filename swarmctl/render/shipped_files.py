"""What lands on a host as it stands in `templates/`: tools, and the packages of shipped programs."""

from __future__ import annotations

from functools import cache

from swarmctl import resources
from swarmctl.render.bundle import File

#: A folder of a release -> the packages of `templates/packages` whose files it holds, side by side.
_FOLDERS = {
    "drivers": ("driver", "command", "rosserial", "common"),
    "gate": ("gate", "command", "common"),
    "multimaster": ("multimaster", "common"),
    "teleop": ("teleop",),
}


@cache
def text(path: str) -> bytes:
    """Returns one file, by its path below `templates/`."""
    return (resources.templates() / path).read_bytes()


@cache
def folder(name: str) -> tuple[File, ...]:
    """Returns the files of one folder of a release, as in `templates/`; scripts stay executable."""
    return tuple(file for package in _FOLDERS[name] for file in below(f"packages/{package}", name))


@cache
def below(source: str, target: str) -> tuple[File, ...]:
    """Returns the files below one folder of `templates/`, by their paths below ``target``."""
    root = resources.templates() / source
    return tuple(
        File(
            f"{target}/{path.relative_to(root)}",
            path.read_bytes(),
            0o755 if path.stat().st_mode & 0o100 else 0o644,
        )
        for path in sorted(root.rglob("*"))
        if path.is_file() and "__pycache__" not in path.parts and path.suffix != ".pyc"
    )
