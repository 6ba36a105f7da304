"""The manifest of a release: its files, its units in start order, its links and blocks outside its folder.

swarmctl writes it; the host checks it all the same, because it writes the paths as root.
"""

from __future__ import annotations

import json
import re
from typing import Any, Iterable, NamedTuple, TypedDict

from .errors import RefusedError
from .files import digest_of
from .paths import BLOCK_FILES

NAME = "manifest.json"
FORMAT = 1

_SWARM = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,62}")
_DIGEST = re.compile(r"[0-9a-f]{16}")
_SHA256 = re.compile(r"[0-9a-f]{64}")
_SECRET = re.compile(r"[a-z][a-z0-9-]{0,62}")
_UNIT = re.compile(r"[A-Za-z0-9:_.@\\-]{1,200}\.(?:service|target|timer|socket|path)")
_LEAF = r"[A-Za-z0-9][A-Za-z0-9:_.@\\-]{0,200}"
_LINK = re.compile(
    rf"/etc/systemd/system/(?:{_LEAF}\.(?:wants|requires|d)/)?{_LEAF}|/etc/udev/rules\.d/{_LEAF}"
    rf"|/etc/NetworkManager/conf\.d/{_LEAF}"
)


class FileData(TypedDict):
    """One file in the JSON; ``size`` in bytes."""

    sha256: str
    mode: int
    size: int


class UnitData(TypedDict):
    """One unit in the JSON. ``needs``: the files whose change restarts it; ``digest``: of their contents;
    ``robot``: the one that it drives, or empty."""

    name: str
    needs: list[str]
    robot: str
    digest: str


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


class Entry(NamedTuple):
    """One checked file of a release."""

    sha256: str
    mode: int
    size: int


class Manifest(NamedTuple):
    """A checked manifest. ``units`` are in start order."""

    files: dict[str, Entry]
    units: list[str]
    links: dict[str, str]
    blocks: dict[str, str]
    secrets: list[str]

    @property
    def size(self) -> int:
        """The bytes of all files."""
        return sum(entry.size for entry in self.files.values())


EMPTY = Manifest({}, [], {}, {}, [])


def _require(condition: bool, what: str) -> None:
    if not condition:
        raise RefusedError("not a request of swarmctl: " + what, "are swarmctl and its agent of one version?")


def swarm_name(value: Any) -> str:
    """Returns ``value`` if it is the name of a swarm. Raises ``RefusedError``."""
    _require(isinstance(value, str) and _SWARM.fullmatch(value) is not None, f"swarm {value!r}")
    return str(value)


def is_release_name(value: Any) -> bool:
    """Returns True if ``value`` is a digest."""
    return isinstance(value, str) and _DIGEST.fullmatch(value) is not None


def release_name(value: Any) -> str:
    """Returns ``value`` if it is a digest. Raises ``RefusedError``."""
    _require(is_release_name(value), f"release {value!r}")
    return str(value)


def unit_names(values: Any) -> list[str]:
    """Returns ``values`` if they are names of the swarm's units. Raises ``RefusedError``."""
    _require(isinstance(values, list), f"units {values!r}")
    for value in values:
        _require(isinstance(value, str) and _UNIT.fullmatch(value) is not None, f"unit {value!r}")
    return list(values)


def secret_names(values: Any) -> list[str]:
    """Returns ``values`` if they are names of secrets. Raises ``RefusedError``."""
    _require(isinstance(values, list), f"secrets {values!r}")
    for value in values:
        _require(isinstance(value, str) and _SECRET.fullmatch(value) is not None, f"secret {value!r}")
    return list(values)


def _relative(path: Any) -> bool:
    return (
        isinstance(path, str)
        and 0 < len(path) < 1024
        and path.isprintable()
        and path != NAME
        and all(part not in ("", ".", "..") for part in path.split("/"))
    )


def _entry(path: str, raw: dict[str, Any]) -> Entry:
    entry = Entry(raw["sha256"], raw["mode"], raw["size"])
    _require(
        isinstance(entry.sha256, str)
        and _SHA256.fullmatch(entry.sha256) is not None
        and isinstance(entry.mode, int)
        and 0 <= entry.mode <= 0o777
        and isinstance(entry.size, int)
        and entry.size >= 0,
        f"file {path!r}",
    )
    return entry


def _places(raw: Any, files: Iterable[str], allowed: re.Pattern[str], what: str) -> dict[str, str]:
    _require(isinstance(raw, dict), what)
    for path, source in raw.items():
        _require(allowed.fullmatch(path) is not None, f"{what} at {path!r}")
        _require(source in files, f"{what} at {path!r} from {source!r}")
    return dict(raw)


def parse(content: bytes, digest: str) -> Manifest:
    """Returns the manifest with these bytes, whose digest must match. Raises ``RefusedError``."""
    _require(digest_of(content)[: len(digest)] == digest, f"the manifest is not that of release {digest}")
    raw = json.loads(content.decode("utf-8"))
    _require(raw.get("format") == FORMAT, "a manifest of format {!r}".format(raw.get("format")))
    for path in raw["files"]:
        _require(_relative(path), f"file {path!r}")
    files = {path: _entry(path, entry) for path, entry in raw["files"].items()}
    blocks = re.compile("|".join(re.escape(path) for path in BLOCK_FILES))
    return Manifest(
        files,
        unit_names([unit["name"] for unit in raw["units"]]),
        _places(raw["links"], files, _LINK, "link"),
        _places(raw["blocks"], files, blocks, "block"),
        secret_names(raw.get("secrets", [])),
    )
