"""Libraries that only some verbs need, by the extra of ``pip`` that installs them."""

from __future__ import annotations

from importlib.util import find_spec

from swarmctl.cli import console, exit_codes

LIBRARIES = {
    "experiments": ("matplotlib", "pandas", "rosbags"),
    "metrics": ("prometheus_client",),
    "ui": ("rosbags", "starlette", "uvicorn", "websockets"),
}


def missing(extra: str) -> list[str]:
    """Returns the libraries of an extra that are not installed."""
    return [name for name in LIBRARIES[extra] if find_spec(name) is None]


def need(what: str, extra: str, *libraries: str) -> None:
    """Ends the program if a library is missing that ``what``, a verb or an option, needs; by default all."""
    if lacks := [name for name in missing(extra) if name in (libraries or LIBRARIES[extra])]:
        console.fail(
            f"{what} needs {', '.join(lacks)}, which {'is' if len(lacks) == 1 else 'are'} not installed",
            f"install {'it' if len(lacks) == 1 else 'them'}: `pip install 'swarmctl[{extra}]'`",
            code=exit_codes.USAGE,
        )
