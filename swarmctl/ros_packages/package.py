"""A ROS package, from its listing and the text of some of its files."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from hashlib import sha256

from swarmctl.ros_packages.message_definitions import (
    Definition,
    DefinitionError,
    definition_of,
    messages_of_action,
)
from swarmctl.ros_packages.package_manifest import holds
from swarmctl.ros_packages.xml_tags import Tag, XmlError, root_of

MANIFEST = "package.xml"
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]*")
_DEPENDS = (
    "depend", "build_depend", "build_export_depend", "exec_depend", "run_depend", "test_depend",
    "buildtool_depend", "buildtool_export_depend",
)  # fmt: skip
_TO_BUILD = ("depend", "build_depend", "build_export_depend", "buildtool_depend")
_TO_RUN = ("depend", "exec_depend", "run_depend")
_SCRIPTS = {"", ".py", ".sh", ".bash", ".pl", ".rb", ".lua"}
_COMMENT = re.compile(r"#.*")
_TARGET = re.compile(r"\b\w*add_executable\s*\(\s*\"?([^\s\")]+)", re.I)
_OUTPUT = re.compile(r"\bOUTPUT_NAME\s+\"?([^\s\")]+)", re.I)
_PROGRAMS = re.compile(
    r"\b(?:catkin_install_python|install)\s*\(\s*PROGRAMS\s+((?:(?!DESTINATION)[^)])*)", re.I
)
_PROJECT = re.compile(r"\bproject\s*\(\s*\"?([^\s\")]+)", re.I)
_COMPUTED = re.compile(r"\b(?:foreach|function|macro|include|file\s*\(\s*GLOB)\b", re.I)


@dataclass(frozen=True)
class Package:
    """One package: its files by path, True for those that may be executed, and the texts that were read."""

    name: str
    folder: str  # as messages show it
    depends: frozenset[str]
    files: Mapping[str, bool]
    contents: Mapping[str, bytes]
    to_build: frozenset[str] = frozenset()  # the part of `depends` that its build needs
    to_run: frozenset[str] = frozenset()

    @cached_property
    def programs(self) -> frozenset[str]:
        """What CMakeLists.txt builds or installs as an executable."""
        found: set[str] = set()
        for text in self._cmake_texts():
            found.update(self._expanded(name) for name in (*_TARGET.findall(text), *_OUTPUT.findall(text)))
            for listed in _PROGRAMS.findall(text):
                found.update(posixpath.basename(self._expanded(one.strip('"'))) for one in listed.split())
        return frozenset(found)

    @cached_property
    def is_computed(self) -> bool:
        """True if CMake computes names of executables, so that they cannot be known from its text."""
        return any("$" in one for one in self.programs) or any(map(_COMPUTED.search, self._cmake_texts()))

    def _cmake_texts(self) -> Iterator[str]:
        for path, content in self.contents.items():
            if posixpath.basename(path) == "CMakeLists.txt":
                yield _COMMENT.sub("", content.decode("utf-8", "replace"))

    def _expanded(self, name: str) -> str:
        for variable in ("${PROJECT_NAME}", "${CMAKE_PROJECT_NAME}", "${CATKIN_PACKAGE_NAME}"):
            name = name.replace(variable, self._project)
        return name

    @cached_property
    def _project(self) -> str:
        return next((one for text in self._cmake_texts() for one in _PROJECT.findall(text)), self.name)

    def executable(self, name: str) -> bool | None:
        """True if roslaunch finds the executable, False if the file lacks the permission, None without it."""
        found = [may for path, may in self.files.items() if posixpath.basename(path) == name]
        if name in self.programs or any(found):
            return True
        return False if found else None

    @cached_property
    def executables(self) -> tuple[str, ...]:
        """The names that a program of this package may have."""
        scripts = {
            posixpath.basename(path)
            for path, may in self.files.items()
            if path.endswith(".py") or (may and posixpath.splitext(path)[1] in _SCRIPTS)
        }
        return tuple(sorted((scripts | self.programs) - {"setup.py", "__init__.py"}))

    @cached_property
    def definitions(self) -> tuple[Mapping[str, Definition], Mapping[str, DefinitionError]]:
        """The messages of the package by type, those of its actions too, and the files that are none."""
        right: dict[str, Definition] = {}
        wrong: dict[str, DefinitionError] = {}
        for path, content in self.contents.items():
            folder, name = posixpath.split(path)
            stem, suffix = posixpath.splitext(name)
            try:
                text = content.decode()
                if (folder, suffix) == ("msg", ".msg"):
                    right[f"{self.name}/{stem}"] = definition_of(text, self.name)
                elif (folder, suffix) == ("action", ".action"):
                    for of_action, one in messages_of_action(stem, text):
                        right[f"{self.name}/{of_action}"] = definition_of(one, self.name)
            except DefinitionError as error:
                wrong[path] = error
            except UnicodeDecodeError:
                if suffix in {".msg", ".action"}:
                    wrong[path] = DefinitionError(1, "the file is not UTF-8")
        return right, wrong

    def launch_paths(self) -> tuple[str, ...]:
        """The launch files in the folder `launch`, by their path in it."""
        found = (path.removeprefix("launch/") for path in self.files if path.startswith("launch/"))
        return tuple(sorted(found))


@dataclass(frozen=True)
class DeliveredPackage:
    """A package that travels with a release: content and permission to execute by path within it.

    ``built_by``: the line of its CMakeLists.txt that only a build obeys; empty if it needs none. ``to_build``
    and ``to_run`` are what its package.xml names for either.
    """

    name: str
    files: Mapping[str, tuple[bytes, bool]] = field(repr=False)
    depends: frozenset[str] = frozenset()
    built_by: str = ""
    to_build: frozenset[str] = frozenset()
    to_run: frozenset[str] = frozenset()
    folder: str = ""  # as messages show it
    skip_keys: frozenset[str] = frozenset()  # of those above, what hosts need not have
    entry: str = ""  # the entry of `packages` that brings it, if that is called otherwise

    @property
    def origin(self) -> str:
        """The entry of the spec that brings it, as messages show it."""
        return f"packages.{self.entry} ({self.name})" if self.entry else f"packages.{self.name}"

    @cached_property
    def digest(self) -> str:
        """The SHA-256 of its files, their paths and permissions."""
        total = sha256()
        for path, (content, may) in sorted(self.files.items()):
            total.update(f"{len(path)} {path} {may:d} {len(content)}\n".encode() + content)
        return total.hexdigest()

    @property
    def has_modules(self) -> bool:
        """True if Python modules of it are imported by others: they lie in its folder `src`."""
        return any(path.startswith("src/") and path.endswith("/__init__.py") for path in self.files)


@dataclass(frozen=True)
class Packages:
    """The packages that lie beside a spec or in the operator's workspaces; a name may occur twice.

    ``delivered`` are those that travel with a release, ``refused`` has why others cannot, both by name.
    """

    found: tuple[Package, ...] = ()
    delivered: Mapping[str, DeliveredPackage] = field(default_factory=dict)
    refused: Mapping[str, str] = field(default_factory=dict)
    by_name: Mapping[str, Package] = field(init=False)

    def __post_init__(self) -> None:
        """Looks packages up by name; the first of a name counts, as in ROS_PACKAGE_PATH."""
        object.__setattr__(self, "by_name", {one.name: one for one in reversed(self.found)})


NO_PACKAGES = Packages()


def package_of(folder: str, files: Mapping[str, bool], contents: Mapping[str, bytes]) -> Package | None:
    """Returns the package in a folder; None if its package.xml names none."""
    try:
        root = root_of(contents.get(MANIFEST, b""))
    except XmlError:
        return None
    named = _texts(root.children, ("name",))
    if root.name != "package" or len(named) != 1 or not _NAME.fullmatch(named[0]):
        return None
    depends, to_build, to_run = (
        frozenset(_texts(root.children, tags)) for tags in (_DEPENDS, _TO_BUILD, _TO_RUN)
    )
    return Package(named[0], folder, depends, files, contents, to_build, to_run)


def _texts(tags: Iterable[Tag], names: tuple[str, ...]) -> list[str]:
    """The texts of the tags that apply to ROS 1."""
    return [
        tag.text.strip() for tag in tags if tag.name in names and holds(tag.attributes.get("condition", ""))
    ]
