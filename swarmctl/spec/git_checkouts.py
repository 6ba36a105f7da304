"""Where the files of a git commit are on the operator's side, once they were fetched."""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path

from swarmctl.resources import cache_folder

#: In the finding about a package whose commit is not there.
NOT_FETCHED = "is not fetched"


def checkouts() -> Path:
    """Returns the folder of all fetched commits."""
    return cache_folder() / "git"


def checkout_of(address: str, commit: str) -> Path:
    """Returns the folder with the files of a commit; it exists only if the commit was fetched."""
    return checkouts() / sha256(f"{address} {commit}".encode()).hexdigest()[:32]
