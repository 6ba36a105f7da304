"""A folder of files that can be had again: each is written whole or not at all, the oldest go first."""

from __future__ import annotations

import os
import threading
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class LruCacheDir:
    """Files with names of the caller and one ``suffix``; of all together ``max_bytes`` are kept."""

    folder: Path
    suffix: str
    max_bytes: int

    def names(self) -> frozenset[str]:
        """Returns the names of the files, without the suffix."""
        return frozenset(one.name.removesuffix(self.suffix) for one in self._files())

    def find(self, name: str) -> bytes | None:
        """Returns the content of a file, which counts as new again; None if it cannot be read."""
        path = self._path(name)
        try:
            content = path.read_bytes()
            path.touch()
        except OSError:
            return None
        return content

    def keep(self, name: str, content: bytes) -> None:
        """Writes a file, and removes the oldest ones beyond ``max_bytes``. Raises ``OSError``."""
        self.folder.mkdir(parents=True, exist_ok=True)
        draft = self.folder / f".{name}.{os.getpid()}.{threading.get_ident()}"
        try:
            draft.write_bytes(content)
            draft.replace(self._path(name))
        finally:
            draft.unlink(missing_ok=True)
        self._remove_oldest()

    def _remove_oldest(self) -> None:
        kept = 0
        stored = [(one.stat(), one) for one in self._files()]
        for state, path in sorted(stored, key=lambda one: one[0].st_mtime_ns, reverse=True):
            kept += state.st_size
            if kept > self.max_bytes:
                path.unlink(missing_ok=True)

    def _files(self) -> list[Path]:
        return list(self.folder.glob(f"[!.]*{self.suffix}"))

    def _path(self, name: str) -> Path:
        return self.folder / f"{name}{self.suffix}"
