"""The JSON of a manifest, see ``manifest``. Types only, which a host does not load."""

from __future__ import annotations

from typing import TypedDict


class FileData(TypedDict):
    """One file in the JSON; ``size`` in bytes."""

    sha256: str
    mode: int
    size: int


class UnitAlways(TypedDict):
    """The required keys of a unit."""

    name: str
    needs: list[str]
    robot: str
    digest: str


class UnitData(UnitAlways, total=False):
    """One unit in the JSON. ``needs``: the files whose change restarts it; ``digest``: of their contents;
    ``robot``: the one that it drives, or empty; ``fixed``: the digest without what its program takes while it
    runs, if there is any; ``secrets``: those that it reads."""

    fixed: str
    secrets: list[str]


class ManifestAlways(TypedDict):
    """The required keys of a manifest."""

    format: int
    swarm: str
    host: str
    files: dict[str, FileData]
    units: list[UnitData]
    links: dict[str, str]
    blocks: dict[str, str]


class ManifestData(ManifestAlways, total=False):
    """``manifest.json``. ``links`` and ``blocks``: absolute path on the host to a file of the release."""

    secrets: list[str]
