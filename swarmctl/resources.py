"""Folders of the files that swarmctl ships: beside the package in a checkout, inside it in a wheel."""

import os
import sys
from dataclasses import dataclass
from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def _folder(name: str) -> Path:
    installed = _PACKAGE / "data" / name
    return installed if installed.is_dir() else _PACKAGE.parent / name


def cache_folder() -> Path:
    """Returns the operator's folder of what swarmctl can make or fetch again (XDG base directories)."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "swarmctl"


def templates() -> Path:
    """Returns the folder of robot types, host templates and the packages that run on hosts."""
    return _folder("templates")


def schemas() -> Path:
    """Returns the folder of the generated JSON Schemas."""
    return _folder("schemas")


@dataclass(frozen=True)
class HostModule:
    """A Python module that runs on hosts: its dotted name, and the folder that its package lies in."""

    name: str
    folder: Path


def make_robot_packages_importable() -> None:
    """Let swarmctl import the packages that it shares with robots: the agent's types, the driver.

    They are shipped as files and not installed; in a checkout and in a wheel they are imported from there.
    """
    for package in sorted((templates() / "packages").glob("*/swarm_*")):
        path = str(package.parent)
        if path not in sys.path:
            sys.path.append(path)
