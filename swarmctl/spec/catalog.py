"""The catalog: robot types and computers that swarmctl ships, and robot types that lie beside a spec."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Set
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from swarmctl import resources
from swarmctl.spec.diagnostics import Diagnostic, has_errors
from swarmctl.spec.files import Read, content
from swarmctl.spec.model import Computer, Computers
from swarmctl.spec.robot_type import RobotType
from swarmctl.spec.source import parse
from swarmctl.spec.validation import M, validated


@dataclass(frozen=True)
class Catalog:
    """Robot types and computers by name, and what is wrong with the files they come from."""

    types: Mapping[str, RobotType] = field(default_factory=dict)
    computers: Mapping[str, Computer] = field(default_factory=dict)
    diagnostics: tuple[Diagnostic, ...] = ()


def load_catalog(beside: Path | None = None, others: Iterable[str] = (), read: Read = content) -> Catalog:
    """The shipped catalog, with the robot types of the folder ``beside`` on top; ``others`` are no types."""
    shipped = _shipped()
    if beside is None or not beside.is_dir():
        return shipped
    types, diagnostics = _types_in(beside, {os.path.realpath(file) for file in others}, read)
    return Catalog({**shipped.types, **types}, shipped.computers, (*shipped.diagnostics, *diagnostics))


@cache
def _shipped() -> Catalog:
    types, diagnostics = _types_in(resources.templates() / "robots")
    computers, problems = _read(resources.templates() / "computers.yaml", Computers)
    return Catalog(types, computers.root if computers else {}, (*diagnostics, *problems))


def _types_in(
    folder: Path, others: Set[str] = frozenset(), read: Read = content
) -> tuple[dict[str, RobotType], tuple[Diagnostic, ...]]:
    files = [file for file in sorted(folder.glob("*.yaml")) if os.path.realpath(file) not in others]
    found = {file.stem: _read(file, RobotType, read) for file in files}
    types = {name: robot_type for name, (robot_type, _) in found.items() if robot_type is not None}
    return types, tuple(one for _, problems in found.values() for one in problems)


def _read(file: Path, model: type[M], read: Read = content) -> tuple[M | None, list[Diagnostic]]:
    try:
        source, problems = parse(read(file).decode("utf-8-sig"), str(file))
    except (OSError, UnicodeDecodeError) as error:
        return None, [Diagnostic("FILE001", f"cannot read {file}: {error}")]
    if has_errors(problems):
        return None, problems
    value, wrong = validated(model, source)
    return value, [*problems, *wrong]
