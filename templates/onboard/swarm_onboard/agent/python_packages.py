"""Python packages that programs of the host import: which are installed, and their installation by pip."""

from __future__ import annotations

import glob
import re
from importlib import metadata

from . import command
from .errors import RefusedError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Callable, Iterable, Sequence

#: Name and optional exact version, as pip takes them.
REQUIREMENT = re.compile(r"([A-Za-z0-9][A-Za-z0-9._-]{0,100})(?:==([A-Za-z0-9][A-Za-z0-9.+!_-]{0,60}))?")
_FOLDERS = ("/usr/local/lib/python3*/dist-packages", "/usr/lib/python3/dist-packages")
_INSTALLING = 3600.0  # s


def versions(requirements: Iterable[str], outside: Callable[[str], str]) -> dict[str, str | None]:
    """Returns the installed version by requirement, or None."""
    folders = [folder for pattern in _FOLDERS for folder in glob.glob(outside(pattern))]
    installed: dict[str, str] = {}
    for one in metadata.distributions(path=folders):
        name = one.metadata["Name"]
        if name:
            installed.setdefault(_plain(name), one.version)
    matches = {one: REQUIREMENT.fullmatch(one) for one in requirements}
    return {one: installed.get(_plain(match.group(1))) for one, match in matches.items() if match}


def install(requirements: Sequence[str], note: Callable[[str], None]) -> None:
    """Installs them for all accounts. Raises ``RefusedError`` and ``FailedError``."""
    for one in requirements:
        if not REQUIREMENT.fullmatch(one):
            raise RefusedError(f"{one!r} is not a Python package of an exact version")
    note(f"pip install {' '.join(requirements)}")
    command.run(
        ["python3", "-m", "pip", "install", "--no-input", *requirements],
        f"pip install {' '.join(requirements)}",
        timeout=_INSTALLING,
        env={"PIP_BREAK_SYSTEM_PACKAGES": "1", "PIP_ROOT_USER_ACTION": "ignore"},
    )


def _plain(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()
