"""What a host of a spec gets."""

from __future__ import annotations

from pathlib import Path

from swarmctl.render.build_bundle import bundles
from swarmctl.render.bundle import Bundle
from tests.loading import load_swarm


def bundle_of(folder: Path, text: str, host: str) -> Bundle:
    """The bundle of a ``host`` of the spec ``text``, which is written to ``folder``."""
    spec = folder / "swarm.yaml"
    spec.write_text(text)
    swarm, found = load_swarm(spec)
    assert swarm is not None, found
    return bundles(swarm)[host]


def text_of(bundle: Bundle, path: str) -> str:
    """The text of one of its files."""
    return next(one.content.decode() for one in bundle.files if one.path == path)
