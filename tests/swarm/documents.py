"""Documents of specs that are written in a test."""

from __future__ import annotations

from pathlib import Path

from swarmctl.spec.load import Document, load


def read(folder: Path, text: str) -> Document:
    """Returns the document of a spec in ``folder``."""
    path = folder / "swarm.yaml"
    path.write_text(text, "utf-8")
    document, found = load([path])
    assert document is not None, found
    return document
