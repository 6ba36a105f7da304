"""The manifest of a release: its files, its units in start order, its links and blocks outside its folder.

swarmctl writes it; the host checks it all the same, because it writes the paths as root.
"""

from __future__ import annotations

from . import json_text
from .errors import RefusedError
from .files import digest_of
from .named_tuple import NamedTuple
from .paths import BLOCK_FILES, LINK_FOLDERS
from .texts import is_name

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, Callable, Iterable

NAME = "manifest.json"
FORMAT = 1

_LEAF = ":_.@\\-"  # what a unit, and a link, may have in its name beside letters and digits
_KINDS = ("service", "target", "timer", "socket", "path")
WITH_LINKS = (".wants", ".requires", ".d")  # folders of a unit
_HEXADECIMAL = "0123456789abcdef"


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
    _require(is_name(value, "_.-", 63), f"swarm {value!r}")
    return str(value)


def is_release_name(value: Any) -> bool:
    """Returns True if ``value`` is a digest."""
    return isinstance(value, str) and len(value) == 16 and not value.strip(_HEXADECIMAL)


def is_sha256(value: Any) -> bool:
    """Returns True if ``value`` is a SHA-256 in hexadecimal."""
    return isinstance(value, str) and len(value) == 64 and not value.strip(_HEXADECIMAL)


def release_name(value: Any) -> str:
    """Returns ``value`` if it is a digest. Raises ``RefusedError``."""
    _require(is_release_name(value), f"release {value!r}")
    return str(value)


def unit_names(values: Any) -> list[str]:
    """Returns ``values`` if they are names of the swarm's units. Raises ``RefusedError``."""
    _require(isinstance(values, (list, tuple)), f"units {values!r}")
    for value in values:
        _require(_is_unit(value), f"unit {value!r}")
    return list(values)


def secret_names(values: Any) -> list[str]:
    """Returns ``values`` if they are names of secrets. Raises ``RefusedError``."""
    _require(isinstance(values, (list, tuple)), f"secrets {values!r}")
    for value in values:
        _require(_is_secret(value), f"secret {value!r}")
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
        is_sha256(entry.sha256)
        and isinstance(entry.mode, int)
        and 0 <= entry.mode <= 0o777
        and isinstance(entry.size, int)
        and entry.size >= 0,
        f"file {path!r}",
    )
    return entry


def _leaf(name: str) -> bool:
    return is_name(name, _LEAF, 201)


def _is_unit(value: Any) -> bool:
    return is_name(value, _LEAF, 208) and "." in value and value.rpartition(".")[2] in _KINDS


def _is_secret(value: Any) -> bool:
    return is_name(value, "-", 63) and value[0].isalpha() and value == value.lower()


def _is_link(path: str) -> bool:
    """True in a folder of links, and in a unit's folder of them."""
    folder, _, name = path.rpartition("/")
    if folder not in LINK_FOLDERS:
        outer, _, unit = folder.rpartition("/")
        if outer != LINK_FOLDERS[0] or not unit.endswith(WITH_LINKS) or not _leaf(unit):
            return False
    return _leaf(name)


def _places(raw: Any, files: Iterable[str], allowed: Callable[[str], bool], what: str) -> dict[str, str]:
    _require(isinstance(raw, dict), what)
    for path, source in raw.items():
        _require(allowed(path), f"{what} at {path!r}")
        _require(source in files, f"{what} at {path!r} from {source!r}")
    return dict(raw)


def parse(content: bytes, digest: str) -> Manifest:
    """Returns the manifest with these bytes, whose digest must match. Raises ``RefusedError``."""
    _require(digest_of(content)[: len(digest)] == digest, f"the manifest is not that of release {digest}")
    raw = json_text.loads(content.decode("utf-8"))
    _require(raw.get("format") == FORMAT, "a manifest of format {!r}".format(raw.get("format")))
    for path in raw["files"]:
        _require(_relative(path), f"file {path!r}")
    files = {path: _entry(path, entry) for path, entry in raw["files"].items()}
    return Manifest(
        files,
        unit_names([unit["name"] for unit in raw["units"]]),
        _places(raw["links"], files, _is_link, "link"),
        _places(raw["blocks"], files, BLOCK_FILES.__contains__, "block"),
        secret_names(raw.get("secrets", [])),
    )
