"""Puts the manual pages of all verbs into the wheel, where pip installs them as ``share/man/man1``."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class ManPages(BuildHookInterface):  # type: ignore[type-arg]
    """The build hook that pyproject.toml names; it runs ``tools/man_pages.py`` on the source tree."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Writes the pages to a folder of its own; ``make man`` has them for an editable install."""
        if version == "editable":
            return
        self._made = tempfile.TemporaryDirectory()
        root = Path(self.root)
        found = os.pathsep.join(
            [str(root), *filter(None, sys.path)]
        )  # also where pip put what the build needs
        environment = {**os.environ, "PYTHONPATH": found, "PYTHONDONTWRITEBYTECODE": "1"}
        command = [sys.executable, str(root / "tools/man_pages.py"), self._made.name]
        subprocess.run(command, cwd=root, env=environment, check=True)
        build_data["shared_data"] |= {
            str(page): f"share/man/man1/{page.name}" for page in sorted(Path(self._made.name).iterdir())
        }

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Removes the folder, whose files are in the wheel now."""
        if version != "editable":
            self._made.cleanup()
