"""The catalog: robot types, drivers and computers that swarmctl ships, and types that lie beside a spec."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial
from pathlib import Path
from typing import Generic, TypeVar

import yaml

from swarmctl import resources
from swarmctl.diagnostics import Diagnostic, drop_redundant_warnings, has_errors
from swarmctl.field_types import Parameter
from swarmctl.robot_types.any_robot_type import DRIVERS, ROS, AnyRobotType, form_of
from swarmctl.robot_types.codec_check import read_codec
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.ros_driver import RosDriver
from swarmctl.robot_types.ros_robot_type import RosRobotType
from swarmctl.spec.beside_files import can_be_named, unread_types, warnings
from swarmctl.spec.model import Computer, Computers
from swarmctl.spec.validation import M, validated
from swarmctl.yamltext.files import MAX_FINDINGS, LoadBudget
from swarmctl.yamltext.project_files import ProjectFiles, link_error
from swarmctl.yamltext.source import Source, parse

V = TypeVar("V")


class OnUse(Mapping[str, V], Generic[V]):
    """Values by name, each of which is read when it is used: a spec uses few of the catalog's."""

    def __init__(self, readers: Mapping[str, Callable[[], V]]) -> None:
        self._readers = readers
        self._read: dict[str, V] = {}

    def __getitem__(self, name: str) -> V:
        if name not in self._read:
            self._read[name] = self._readers[name]()
        return self._read[name]

    def __contains__(self, name: object) -> bool:
        return name in self._readers

    def __iter__(self) -> Iterator[str]:
        return iter(self._readers)

    def __len__(self) -> int:
        return len(self._readers)

    def under(self, nearer: Mapping[str, V]) -> OnUse[V]:
        """Returns these values with those of ``nearer``, which come before those of the same name."""
        return OnUse({**self._readers, **{name: partial(nearer.__getitem__, name) for name in nearer}})


@dataclass(frozen=True)
class Catalog:
    """Robot types, drivers and computers by name, and what is wrong with the files they come from.

    ``sources`` are the texts of the types beside a spec, ``codecs`` the texts of their protocol classes,
    ``unread`` the files that seem to be types by their name, and that nothing reads, ``broken`` the types
    whose files have errors, with what could be read.
    """

    types: OnUse[AnyRobotType] = field(default_factory=lambda: OnUse({}))
    computers: Mapping[str, Computer] = field(default_factory=dict)
    diagnostics: tuple[Diagnostic, ...] = ()
    sources: Mapping[str, Source] = field(default_factory=dict)
    codecs: Mapping[str, bytes] = field(default_factory=dict)
    unread: Mapping[str, Path] = field(default_factory=dict)
    broken: Mapping[str, Source | None] = field(default_factory=dict)
    drivers: Mapping[str, RosDriver] = field(default_factory=dict)


def load_catalog(
    beside: Path | None = None, files: ProjectFiles | None = None, others: Iterable[str] = ()
) -> Catalog:
    """Returns the shipped catalog with the robot types of ``beside``, the folder ``robots`` of a spec.

    ``files`` are those of the spec that is read; its files ``others`` are not types.
    """
    shipped = _shipped()
    if beside is None:
        return shipped
    files = files or ProjectFiles.beside(beside, LoadBudget())
    own = _types_beside(beside, files, {os.path.realpath(file) for file in others})
    return replace(
        own,
        types=shipped.types.under(own.types),
        computers=shipped.computers,
        drivers=shipped.drivers,
    )


@cache
def _shipped() -> Catalog:
    files = sorted((resources.templates() / "robots").glob("*.yaml"))
    types = OnUse[AnyRobotType]({file.stem: partial(_shipped_type, file) for file in files})
    drivers = OnUse({name: partial(_shipped_file, file, RosDriver) for name, file in DRIVERS.files.items()})
    computers = _shipped_file(resources.templates() / "data/computers.yaml", Computers)
    return Catalog(types, computers.root, drivers=drivers)


@cache
def _shipped_type(file: Path) -> AnyRobotType:
    robot_type, _, problems = _parsed_type(file.read_text("utf-8"), file, LoadBudget())
    if robot_type is None or problems:
        raise _FaultyFileError(file, problems)
    return robot_type


@cache
def _shipped_file(file: Path, model: type[M]) -> M:
    value, _, problems = _parsed(file.read_text("utf-8"), file, model, LoadBudget())
    if value is None or problems:
        raise _FaultyFileError(file, problems)
    return value


class _FaultyFileError(Exception):
    """A file of the shipped catalog with a fault, which is a bug."""

    def __init__(self, file: Path, problems: Sequence[Diagnostic]) -> None:
        super().__init__(f"{file}: {'; '.join(one.message for one in problems)}")


def _types_beside(folder: Path, files: ProjectFiles, others: set[str]) -> Catalog:
    if folder.is_symlink() and files.refusal(folder):
        return Catalog(diagnostics=(link_error(folder),))
    types: dict[str, AnyRobotType] = {}
    codecs: dict[str, bytes] = {}
    broken: dict[str, Source | None] = {}
    sources: dict[str, Source] = {}
    diagnostics: list[Diagnostic] = []
    unread = unread_types(folder, files, others)
    for file in (folder / name for name in files.names(folder) if can_be_named(name)):
        if files.exhausted or len(diagnostics) >= MAX_FINDINGS:  # which stands in the findings
            break
        if os.path.realpath(file) in others:
            continue
        text = files.text(file)
        if isinstance(text, Diagnostic):
            diagnostics.append(text)
            broken[file.stem] = None
            continue
        robot_type, source, problems = _parsed_type(text, file, files.budget)
        diagnostics += problems
        if robot_type is None:
            broken[file.stem] = source
            continue
        types[file.stem], sources[file.stem] = robot_type, source
        codec, wrong = b"", list[Diagnostic]()
        if isinstance(robot_type, RobotType):
            codec, wrong = read_codec(source, robot_type, files)
        diagnostics += wrong
        if codec:
            codecs[file.stem] = codec
    found = (*diagnostics, *warnings(folder, unread))
    return Catalog(OnUse[AnyRobotType]({}).under(types), {}, found, sources, codecs, unread, broken)


def _parsed_type(
    text: str, file: Path, budget: LoadBudget
) -> tuple[AnyRobotType | None, Source, list[Diagnostic]]:
    source, problems = parse(text, str(file), budget)
    if has_errors(problems):
        return None, source, problems
    value, wrong = valid_type(source)
    return value, source, drop_redundant_warnings([*problems, *wrong])


def valid_type(source: Source) -> tuple[AnyRobotType | None, list[Diagnostic]]:
    """Returns the robot type that a file has, in the form of its keys, or what is wrong with it."""
    if form_of(source.data) == ROS:
        return validated(RosRobotType, source)
    return validated(RobotType, source)


def _parsed(
    text: str, file: Path, model: type[M], budget: LoadBudget
) -> tuple[M | None, Source, list[Diagnostic]]:
    source, problems = parse(text, str(file), budget)
    if has_errors(problems):
        return None, source, problems
    value, wrong = validated(model, source)
    return value, source, drop_redundant_warnings([*problems, *wrong])


@dataclass(frozen=True)
class Setting:
    """One setting. It takes what is of its default's type; whole numbers pass as numbers."""

    default: int | float | str
    meaning: str
    unit: str = ""
    min: float = -math.inf
    max: float = math.inf
    pattern: str = ""
    example: str = ""

    def takes(self, value: Parameter) -> bool:
        """Returns True if ``value`` has the setting's type and is within its bounds."""
        if isinstance(value, bool) or not isinstance(value, (int, float, str)):
            return False
        if isinstance(self.default, str) or isinstance(value, str):
            text = isinstance(self.default, str) and isinstance(value, str)
            return text and re.fullmatch(self.pattern, str(value)) is not None
        whole = isinstance(value, int) or isinstance(self.default, float)
        return whole and self.min <= value <= self.max

    @property
    def range(self) -> str:
        """What it takes, in words."""
        if isinstance(self.default, str):
            return f"text such as {self.example}"
        kind = "a whole number" if isinstance(self.default, int) else "a number"
        return f"{kind} from {self.min:g} to {self.max:g} {self.unit}".rstrip()


@cache
def shipped() -> Mapping[str, Mapping[str, Setting]]:
    """Returns the settings of shipped programs by name (swarm_onboard/teleop/settings.yaml)."""
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    data = yaml.load((resources.onboard() / "teleop/settings.yaml").read_text("utf-8"), loader)
    return {
        program: {name: Setting(**fields) for name, fields in settings.items()}
        for program, settings in data.items()
    }
