"""SPEC and ``-f`` of every verb as one value: the spec's file and its overlays."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import typer


@dataclass(frozen=True)
class SpecFiles:
    """The files of one spec, each an overlay on those before. Files beside the spec are beside ``first``."""

    files: tuple[Path, ...]
    workspaces: tuple[Path, ...] = ()  # folders with ROS packages that the operator names

    @property
    def first(self) -> Path:
        """The spec's own file; the others are overlays."""
        return self.files[0]

    def __str__(self) -> str:
        return " -f ".join(map(str, self.files))


def file(name: str) -> SpecFiles:
    """Returns the argument SPEC as a value."""
    return SpecFiles((Path(name),))


def given(context: typer.Context, spec: SpecFiles | None) -> SpecFiles | None:
    """SPEC with the overlays; without SPEC, the first overlay is the spec. None without any file."""
    overlays = tuple(context.params.get("overlays") or ())
    files = (*(spec.files if spec else ()), *overlays)
    workspaces = tuple(context.params.get("workspaces") or ())
    return SpecFiles(files, workspaces) if files else None


def needed(context: typer.Context, spec: SpecFiles | None) -> SpecFiles | None:
    """The same, for a verb that requires a spec. Raises ``typer.BadParameter`` without one."""
    found = given(context, spec)
    if found is None and not context.resilient_parsing:
        raise typer.BadParameter("missing argument SPEC, the YAML file of the swarm")
    return found


def each(context: typer.Context, specs: list[SpecFiles] | None) -> list[SpecFiles | None]:
    """The same for several specs: the overlays apply to each of them."""
    return [needed(context, spec) for spec in (specs or (None,))]
