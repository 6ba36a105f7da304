"""Modules that run on hosts, with what they import of each other, as an archive that Python imports from."""

from __future__ import annotations

import ast
import io
import threading
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache
from pathlib import Path

import mcap

from swarmctl.resources import HostModule, onboard

Folders = Mapping[str, Path]  # by package
#: One thread at a time: ``ast.parse`` of Python 3.11 fails where threads interleave (python/cpython#106905).
_PARSING = threading.Lock()


def archive_of(names: tuple[str, ...], module: HostModule | None = None) -> bytes:
    """Returns the archive of on-robot modules and of ``module``. Same sources, same bytes.

    Raises ModuleNotFoundError if there is no such module.
    """
    with _PARSING:
        return _archive(names, module)


@lru_cache
def _archive(names: tuple[str, ...], module: HostModule | None) -> bytes:
    folders = {onboard().name: onboard().parent, mcap.__name__: Path(mcap.__path__[0]).parent}
    if module is not None:
        folders[module.name.partition(".")[0]] = module.folder
        names = (*names, module.name)
    modules = _closure(names, folders)
    if missing := [name for name in names if name not in modules]:
        raise ModuleNotFoundError(f"the agent needs {missing[0]}, which is not in {module and module.folder}")
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, path in sorted(modules.items()):
            inside = name.replace(".", "/") + ("/__init__.py" if path.name == "__init__.py" else ".py")
            entry = zipfile.ZipInfo(inside)
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, path.read_bytes())
    return stream.getvalue()


def _closure(names: Iterable[str], folders: Folders) -> dict[str, Path]:
    """The files of these modules, of their packages, and of the modules in ``folders`` that they import."""
    found: dict[str, Path] = {}
    due = list(names)
    while due:
        name = due.pop()
        path = None if name in found else _file_of(name, folders)
        if path is not None:
            found[name] = path
            due += [*_imports(name, path), name.rpartition(".")[0]]
    return found


def _file_of(module: str, folders: Folders) -> Path | None:
    """The source of an on-robot module or package; None for a name that is neither."""
    folder = folders.get(module.partition(".")[0])
    if folder is None:
        return None
    base = folder / module.replace(".", "/")
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


def _running(tree: ast.Module) -> Iterator[ast.AST]:
    """The statements that run, in functions too; an import is one, so no expression is looked at."""
    due: list[ast.AST] = [*tree.body]
    while due:
        node = due.pop()
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            continue
        yield node
        for part in ("body", "orelse", "finalbody", "handlers"):
            due += getattr(node, part, ())
