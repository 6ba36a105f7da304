"""What lands on a host as it stands in `templates/`: tools, and the packages of shipped programs."""

from __future__ import annotations

from functools import cache

from swarmctl import resources
from swarmctl.render.bundle import File

_SHARING = ("drivers", "sync")  # packages whose programs import `templates/shared`


@cache
def text(path: str) -> bytes:
    """One file, by its path below `templates/`."""
    return (resources.templates() / path).read_bytes()


@cache
def folder(name: str, target: str = "") -> tuple[File, ...]:
    """The files of a package, with what it shares with others beside it; scripts stay executable."""
    return (*_files(name, target or name), *(_files("shared", name) if name in _SHARING else ()))


def _files(source: str, target: str) -> tuple[File, ...]:
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
