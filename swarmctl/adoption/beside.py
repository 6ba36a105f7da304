"""The file beside a spec that is a file of a release, unchanged."""

from __future__ import annotations

from pathlib import Path

from swarmctl.render.bundle import File
from swarmctl.spec.load import Document
from swarmctl.yamltext.files import content

_PACKAGES = "packages"


def beside(document: Document, file: File) -> str:
    """Returns the path of the file beside the spec whose content ``file`` has; empty if there is none."""
    folder = Path(document.source.path).parent
    name = Path(file.path).name
    paths = [path for path, found in document.files.content.items() if found == file.content]
    paths.sort(key=lambda path: Path(path).name != name)
    if paths:
        return str(folder / paths[0])
    head, _, rest = file.path.partition("/")
    package, _, inside = rest.partition("/")
    source = document.spec.packages.get(package)
    if head != _PACKAGES or source is None or source.all:
        return ""
    place = folder / source.folder / inside
    try:
        return str(place) if content(place) == file.content else ""
    except OSError:
        return ""
