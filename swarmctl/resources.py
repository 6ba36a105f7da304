"""Folders of the files that swarmctl ships: beside the package in a checkout, inside it in a wheel."""

import os
from dataclasses import dataclass
from pathlib import Path

import swarm_onboard

_PACKAGE = Path(__file__).resolve().parent


def _folder(name: str) -> Path:
    installed = _PACKAGE / "data" / name
    return installed if installed.is_dir() else _PACKAGE.parent / name


def cache_folder() -> Path:
    """Returns the operator's folder of what swarmctl can make or fetch again (XDG base directories)."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "swarmctl"


def templates() -> Path:
    """Returns the folder of robot types and host templates."""
    return _folder("templates")


def onboard() -> Path:
    """Returns the folder of the package `swarm_onboard`, which runs on hosts."""
    return Path(swarm_onboard.__path__[0])


def host_check_names() -> tuple[str, ...]:
    """Returns the names of the checks in `swarm_onboard.host_checks`."""
    files = (onboard() / "host_checks").glob("[a-z]*.py")
    return tuple(sorted(file.stem for file in files))


def schemas() -> Path:
    """Returns the folder of the generated JSON Schemas."""
    return _folder("schemas")


@dataclass(frozen=True)
class HostModule:
    """A Python module that runs on hosts: its dotted name, and the folder that its package lies in."""

    name: str
    folder: Path
