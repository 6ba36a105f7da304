"""The manifest of a release: the JSON that the agent reads (swarm_onboard.agent.manifest)."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from hashlib import sha256
from json.encoder import encode_basestring_ascii as _quoted

from typing_extensions import NotRequired, TypedDict  # pydantic checks no other before Python 3.12


class FileData(TypedDict):
    """One file in the JSON; ``size`` in bytes."""

    sha256: str
    mode: int
    size: int


class UnitData(TypedDict):
    """One unit in the JSON. ``needs``: the files whose change restarts it; ``digest``: of their contents;
    ``robot``: the one that it drives, or empty; ``fixed``: the digest without what its program takes while it
    runs, if there is any; ``secrets``: those that it reads."""

    name: str
    needs: list[str]
    robot: str
    digest: str
    fixed: NotRequired[str]
    secrets: NotRequired[list[str]]


class ManifestData(TypedDict):
    """``manifest.json``. ``links`` and ``blocks``: absolute path on the host to a file of the release."""

    format: int
    swarm: str
    host: str
    files: dict[str, FileData]
    units: list[UnitData]
    links: dict[str, str]
    blocks: dict[str, str]
    secrets: NotRequired[list[str]]


def digest_of(content: bytes) -> str:
    """SHA-256 of ``content`` in hexadecimal."""
    return sha256(content).hexdigest()


def unit_data(
    name: str,
    needs: Sequence[str],
    robot: str,
    secrets: Sequence[str],
    *,
    digests: Mapping[str, str],
    fixed: Mapping[str, str],
) -> UnitData:
    """Returns the entry of one unit. Its digest changes when one of the files that it ``needs`` does.

    ``fixed``: of files that a running program takes in part, the digests of the rest.
    """
    combined = digest_of("".join(digests[path] for path in needs).encode())
    unit: UnitData = {"name": name, "needs": list(needs), "robot": robot, "digest": combined}
    if not fixed.keys().isdisjoint(needs):
        unit["fixed"] = digest_of("".join(fixed.get(path, digests[path]) for path in needs).encode())
    return {**unit, "secrets": list(secrets)} if secrets else unit


def manifest_bytes(manifest: ManifestData) -> bytes:
    """``manifest.json``. Same manifest, same bytes."""
    return f"{_indented(manifest, chr(10))}\n".encode()


def _indented(value: object, line: str) -> str:
    """JSON with an indentation of 1 and sorted keys, as ``json.dumps`` writes it in four times the time.

    ``line`` is a line end with the indentation of ``value``.
    """
    below = f"{line} "
    if isinstance(value, dict) and value:
        items = [
            f"{_quoted(key)}: {_quoted(one) if type(one) is str else _indented(one, below)}"
            for key, one in sorted(value.items())
        ]
        return f"{{{below}{f',{below}'.join(items)}{line}}}"
    if isinstance(value, list) and value:
        items = [_quoted(one) if type(one) is str else _indented(one, below) for one in value]
        return f"[{below}{f',{below}'.join(items)}{line}]"
    return str(value) if type(value) is int else json.dumps(value)


def release_digest(content: bytes) -> str:
    """Returns the name of the release with this ``manifest.json``: the first 16 digits of its SHA-256."""
    return digest_of(content)[:16]
