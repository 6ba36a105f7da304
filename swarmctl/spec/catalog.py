"""The catalog: robot types and computers that swarmctl ships, and robot types that lie beside a spec."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Set
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from swarmctl import resources
from swarmctl.diagnostics import Diagnostic, has_errors
from swarmctl.robot_types.codec_check import read_codec
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.spec.model import Computer, Computers
from swarmctl.spec.validation import M, validated
from swarmctl.yamltext.files import Read, content
from swarmctl.yamltext.source import Source, parse


@dataclass(frozen=True)
class Catalog:
    """Robot types and computers by name, and what is wrong with the files they come from.

    ``codecs`` are the files with the protocol classes of the types that have one.
    """

    types: Mapping[str, RobotType] = field(default_factory=dict)
    computers: Mapping[str, Computer] = field(default_factory=dict)
    diagnostics: tuple[Diagnostic, ...] = ()
    codecs: Mapping[str, bytes] = field(default_factory=dict)


def load_catalog(beside: Path | None = None, others: Iterable[str] = (), read: Read = content) -> Catalog:
    """Returns the shipped catalog with the robot types of the folder ``beside``.

    The files ``others`` are no types.
    """
    shipped = _shipped()
    if beside is None or not beside.is_dir():
        return shipped
    own = _types_in(beside, {os.path.realpath(file) for file in others}, read)
    diagnostics = (*shipped.diagnostics, *own.diagnostics)
    return Catalog({**shipped.types, **own.types}, shipped.computers, diagnostics, own.codecs)


@cache
def _shipped() -> Catalog:
    found = _types_in(resources.templates() / "robots")
    computers, _, problems = _read(resources.templates() / "data/computers.yaml", Computers)
    return Catalog(found.types, computers.root if computers else {}, (*found.diagnostics, *problems))


def _types_in(folder: Path, others: Set[str] = frozenset(), read: Read = content) -> Catalog:
    types: dict[str, RobotType] = {}
    codecs: dict[str, bytes] = {}
    diagnostics: list[Diagnostic] = []
    for file in sorted(folder.glob("*.yaml")):
        if os.path.realpath(file) in others:
            continue
        robot_type, source, problems = _read(file, RobotType, read)
        diagnostics += problems
        if robot_type is None or source is None:
            continue
        types[file.stem] = robot_type
        codec, wrong = read_codec(source, robot_type, read)
        diagnostics += wrong
        if codec:
            codecs[file.stem] = codec
    return Catalog(types, diagnostics=tuple(diagnostics), codecs=codecs)


def _read(
    file: Path, model: type[M], read: Read = content
) -> tuple[M | None, Source | None, list[Diagnostic]]:
    try:
        source, problems = parse(read(file).decode("utf-8-sig"), str(file))
    except (OSError, UnicodeDecodeError) as error:
        return None, None, [Diagnostic("FILE001", f"cannot read {file}: {error}")]
    if has_errors(problems):
        return None, source, problems
    value, wrong = validated(model, source)
    return value, source, [*problems, *wrong]
