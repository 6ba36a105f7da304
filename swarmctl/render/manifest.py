"""The manifest of a release, in the types that the agent reads (swarm_agent.manifest)."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from hashlib import sha256

from swarm_agent.manifest import FileData, ManifestData, UnitData


def digest_of(content: bytes) -> str:
    """SHA-256 of ``content`` in hexadecimal."""
    return sha256(content).hexdigest()


def file_data(content: bytes, digest: str, mode: int) -> FileData:
    """Returns the entry of one file; ``digest`` is that of ``content``."""
    return {"sha256": digest, "mode": mode, "size": len(content)}


def unit_data(name: str, needs: Sequence[str], robot: str, digests: Mapping[str, str]) -> UnitData:
    """Returns the entry of one unit. Its digest changes when one of the files that it ``needs`` does."""
    combined = digest_of("".join(digests[path] for path in needs).encode())
    return {"name": name, "needs": list(needs), "robot": robot, "digest": combined}


def manifest_bytes(manifest: ManifestData) -> bytes:
    """``manifest.json``. Same manifest, same bytes."""
    return (json.dumps(manifest, indent=1, sort_keys=True) + "\n").encode()


def release_digest(content: bytes) -> str:
    """Returns the name of the release with this ``manifest.json``: the first 16 digits of its SHA-256."""
    return digest_of(content)[:16]
