"""Where the files that swarmctl ships live: beside the package in a checkout, inside it in a wheel."""

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def _folder(name: str) -> Path:
    installed = _PACKAGE / "data" / name
    return installed if installed.is_dir() else _PACKAGE.parent / name


def templates() -> Path:
    """The folder of everything that lands on a robot: robot types, drivers, agent, host templates."""
    return _folder("templates")


def schemas() -> Path:
    """The folder of the generated JSON Schemas."""
    return _folder("schemas")
