"""The commit of a folder, by ``git``."""

from __future__ import annotations

import subprocess
from pathlib import Path

from swarmctl.capsule.capsule_index import Git

_PATIENCE = 30.0  # s


def git_state(folder: Path) -> Git | None:
    """Returns the commit of a folder, and whether something in it differs; None without git or a commit."""
    commit = _git(folder, "rev-parse", "HEAD")
    changes = commit and _git(folder, "status", "--porcelain", "--", ".")
    return None if commit is None or changes is None else Git(commit=commit.strip(), changed=bool(changes))


def _git(folder: Path, *arguments: str) -> str | None:
    try:
        ran = subprocess.run(
            ["git", "--no-optional-locks", "-C", str(folder), *arguments],
            capture_output=True, check=False, timeout=_PATIENCE, stdin=subprocess.DEVNULL,
        )  # fmt: skip
    except (OSError, subprocess.TimeoutExpired):
        return None
    return None if ran.returncode else ran.stdout.decode(errors="replace")
