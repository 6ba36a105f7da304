"""SPEC and ``-f`` of every verb, as one value: the spec's file, and the files that are laid over it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import typer


@dataclass(frozen=True)
class Layers:
    """Files that make one spec, each laid over those before. What lies beside a spec is beside the first."""

    files: tuple[Path, ...]

    @property
    def first(self) -> Path:
        return self.files[0]

    def __str__(self) -> str:
        return " -f ".join(map(str, self.files))


def file(name: str) -> Layers:
    return Layers((Path(name),))


def given(context: typer.Context, spec: Layers | None) -> Layers | None:
    """SPEC with the overlays; without SPEC the first overlay is the spec, where there is one."""
    overlays = tuple(context.params.get("overlays") or ())
    files = (*(spec.files if spec else ()), *overlays)
    return Layers(files) if files else None


def needed(context: typer.Context, spec: Layers | None) -> Layers | None:
    """The same for a verb that cannot do without."""
    found = given(context, spec)
    if found is None and not context.resilient_parsing:
        raise typer.BadParameter("name the swarm's YAML file")
    return found


def each(context: typer.Context, specs: list[Layers] | None) -> list[Layers | None]:
    """The same for several specs: what is laid over one is laid over each."""
    return [needed(context, spec) for spec in (specs or (None,))]
