"""A spec file to a typed document with positions, or to diagnostics that say what is wrong and where."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from swarmctl.spec.catalog import Catalog, load_catalog
from swarmctl.spec.diagnostics import Diagnostic, Severity, Span, has_errors
from swarmctl.spec.limits import MAX_BYTES
from swarmctl.spec.model import Computer, Spec
from swarmctl.spec.robot_type import RobotType
from swarmctl.spec.source import Source, parse
from swarmctl.spec.suggest import did_you_mean
from swarmctl.spec.validation import validated


@dataclass(frozen=True)
class Document:
    """A spec, where each of its words stands, and the catalog its names are looked up in."""

    spec: Spec
    source: Source
    catalog: Catalog

    def span(self, *loc: str | int, key: bool = False) -> Span:
        return self.source.span(loc, key=key)

    @property
    def types(self) -> Mapping[str, RobotType]:
        """Robot types by name: the spec's own before the catalog's."""
        return {**self.catalog.types, **self.spec.types}

    @property
    def computers(self) -> Mapping[str, Computer]:
        return {**self.catalog.computers, **self.spec.computers}


def load(path: Path) -> tuple[Document | None, tuple[Diagnostic, ...]]:
    """Read and check one spec file; robot types beside it are found in its folder ``robots/``."""
    name = str(path)
    try:
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
    except OSError as error:
        return None, (_unreadable(path, error),)
    if len(content) > MAX_BYTES:
        return None, (
            Diagnostic("FILE002", f"`{name}` is larger than {MAX_BYTES >> 20} MiB; that is no spec"),
        )
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        return None, (_not_utf8(name, content, error.start),)
    return load_text(text, name, load_catalog(path.resolve().parent / "robots"))


def _unreadable(path: Path, error: OSError) -> Diagnostic:
    if isinstance(error, IsADirectoryError):
        inside = sorted(one.name for one in path.glob("*.yaml"))
        help_ = (f"did you mean `{path / inside[0]}`?",) if inside else ("name the YAML file in it",)
        return Diagnostic("FILE001", f"`{path}` is a folder, not a spec", help=help_)
    if isinstance(error, FileNotFoundError):
        near = did_you_mean(
            path.name, [one.name for one in path.parent.glob("*.yaml")], "YAML files in that folder"
        )
        return Diagnostic("FILE001", f"there is no file `{path}`", help=near)
    return Diagnostic("FILE001", f"cannot read `{path}`: {error.strerror or error}")


def _not_utf8(name: str, content: bytes, start: int) -> Diagnostic:
    before = content[:start].decode("utf-8-sig").splitlines() or [""]
    if content[:start].endswith((b"\n", b"\r")):
        before.append("")
    line, column = len(before), len(before[-1]) + 1
    return Diagnostic(
        "FILE003",
        f"the byte 0x{content[start]:02X} makes no character in UTF-8",
        Span(name, line, column, line, column + 1),
        help=("save the file as UTF-8",),
    )


def load_text(text: str, path: str, catalog: Catalog) -> tuple[Document | None, tuple[Diagnostic, ...]]:
    """The text of one spec, and its warnings; with errors there is no document."""
    source, diagnostics = parse(text, path)
    diagnostics = [*catalog.diagnostics, *diagnostics]
    if source.root is None or source.data is None:
        if not diagnostics:
            diagnostics.append(_empty(path))
        return None, tuple(diagnostics)
    spec, problems = validated(Spec, source)
    diagnostics = _without_echoes([*diagnostics, *problems])
    if spec is None or has_errors(diagnostics):
        return None, tuple(diagnostics)
    return Document(spec, source, catalog), tuple(diagnostics)


def _without_echoes(diagnostics: list[Diagnostic]) -> list[Diagnostic]:
    """What is wrong at a place makes a warning about the same place idle."""
    wrong = {found.span for found in diagnostics if found.severity is Severity.ERROR}
    return [found for found in diagnostics if found.severity is Severity.ERROR or found.span not in wrong]


def _empty(path: str) -> Diagnostic:
    return Diagnostic(
        "SPEC004",
        "there is nothing in this file",
        Span(path, 1, 1, 1, 1),
        help=("a spec begins like: version: 1, name: lab, mode: leader, then hosts, robots and links",),
    )
