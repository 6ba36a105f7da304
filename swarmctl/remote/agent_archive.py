"""The agent as the archive that a host keeps: some of its verbs, and the modules that these import."""

from __future__ import annotations

import ast
import io
import threading
import zipfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from hashlib import sha256
from pathlib import Path

from swarmctl.resources import templates

DEPLOY_VERBS = ("observe", "keep_secrets", "apply", "remove")
_PACKAGES = {"swarm_agent": "agent", "swarm_common": "common"}

#: One thread at a time: ``ast.parse`` of Python 3.11 fails where threads interleave (python/cpython#106905).
_PARSING = threading.Lock()


@dataclass(frozen=True)
class Agent:
    """The agent with some of its verbs, as the archive that a host keeps."""

    archive: bytes = field(repr=False)
    digest: str


def agent(verbs: tuple[str, ...] = DEPLOY_VERBS) -> Agent:
    """The agent with ``verbs``. Same sources, same bytes."""
    with _PARSING:
        return _archive(verbs)


@lru_cache
def _archive(verbs: tuple[str, ...]) -> Agent:
    modules = _closure(["swarm_agent.main", *(f"swarm_agent.verbs.{verb}" for verb in verbs)])
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, path in sorted(modules.items()):
            inside = name.replace(".", "/") + ("/__init__.py" if path.name == "__init__.py" else ".py")
            entry = zipfile.ZipInfo(inside)
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, path.read_bytes())
    content = stream.getvalue()
    return Agent(content, sha256(content).hexdigest())


def _closure(names: Iterable[str]) -> dict[str, Path]:
    """The files of these modules, of their packages, and of the on-robot modules that they import."""
    found: dict[str, Path] = {}
    due = list(names)
    while due:
        name = due.pop()
        path = None if name in found else _file_of(name)
        if path is not None:
            found[name] = path
            due += [*_imports(name, path), name.rpartition(".")[0]]
    return found


def _file_of(module: str) -> Path | None:
    """The source of an on-robot module or package; None for a name that is neither."""
    package = _PACKAGES.get(module.partition(".")[0])
    if package is None:
        return None
    base = templates() / "packages" / package / module.replace(".", "/")
    candidates = (base.with_name(base.name + ".py"), base / "__init__.py")
    return next((path for path in candidates if path.is_file()), None)


def _imports(module: str, path: Path) -> Iterator[str]:
    """What may be a module among the names that a file imports when it runs; not for type checking alone."""
    for node in _running(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            origin = node.module or ""
            if node.level:
                origin = ".".join(filter(None, (".".join(module.split(".")[: -node.level]), origin)))
            yield origin
            yield from (f"{origin}.{alias.name}" for alias in node.names)


def _running(node: ast.AST) -> Iterator[ast.AST]:
    if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
        return
    yield node
    for child in ast.iter_child_nodes(node):
        yield from _running(child)
