"""Loads a spec file: returns a typed document with positions, or diagnostics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import yaml

from swarmctl.diagnostics import Diagnostic, Severity, Span, has_errors
from swarmctl.robot_types.protocols import PythonProtocol
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.settings import RobotSettings
from swarmctl.ros_packages.package import NO_PACKAGES, Packages
from swarmctl.spec.catalog import Catalog, load_catalog
from swarmctl.spec.model import Computer, Spec
from swarmctl.spec.package_search import Search, packages_in
from swarmctl.spec.private_keys import private_keys_in
from swarmctl.spec.validation import validated
from swarmctl.yamltext import ranges
from swarmctl.yamltext.files import Read, content
from swarmctl.yamltext.include import tree_of
from swarmctl.yamltext.limits import LoadBudget
from swarmctl.yamltext.overlay import overlaid
from swarmctl.yamltext.project_files import ProjectFiles
from swarmctl.yamltext.source import Source, source_of


@dataclass(frozen=True)
class Document:
    """A spec, where each of its words stands, and the catalog its names are looked up in."""

    spec: Spec
    source: Source
    catalog: Catalog
    private_keys: tuple[str, ...] = ()  # files beside the spec that are some
    packages: Packages = NO_PACKAGES  # the ROS packages beside the spec, and in the operator's workspaces

    def span(self, *loc: str | int, key: bool = False) -> Span:
        """Returns the position of a value, or with ``key`` of its key."""
        return self.source.span(loc, key=key)

    @property
    def types(self) -> Mapping[str, RobotType]:
        """Robot types by name: the spec's own before the catalog's."""
        return {**self.catalog.types, **self.spec.types}

    @property
    def computers(self) -> Mapping[str, Computer]:
        """The computers of the catalog and of the spec, by name."""
        return {**self.catalog.computers, **self.spec.computers}

    def settings_layers(self, robot: str) -> tuple[RobotSettings, RobotSettings, RobotSettings]:
        """Returns the settings of a robot, from general to specific: `defaults`, its type, its own."""
        given = self.spec.robots[robot]
        robot_type = self.spec.types.get(given.type) or self.catalog.types[given.type]
        return self.spec.defaults.robot, robot_type.settings, given.settings


def load(
    layers: Sequence[Path],
    read: Read = content,
    workspaces: Sequence[Path] = (),
    search: Search = packages_in,
) -> tuple[Document | None, tuple[Diagnostic, ...]]:
    """Read and check one spec: its file, and the files laid over it, each over those before.

    Robot types beside the first file are found in its folder ``robots/``. ``read`` is the only way to files.
    ROS packages are found below the first file's folder, and in ``workspaces``, by ``search``.
    """
    budget = LoadBudget()
    trees: list[yaml.Node] = []
    diagnostics: list[Diagnostic] = []
    for path in layers:
        files = ProjectFiles.beside(path, budget, read)
        text = files.named(path)
        root, found = (None, [text]) if isinstance(text, Diagnostic) else tree_of(text, path, files)
        trees += [root] if root is not None else []
        diagnostics += found
    files = ProjectFiles.beside(layers[0], budget, read)
    catalog = load_catalog(layers[0].parent / "robots", files, budget.texts)
    document, problems = _document(trees, diagnostics, str(layers[0]), budget, catalog)
    if document is not None:
        roots = [(Path(files.root), "")] if files.root and _may_use_packages(document.spec) else []
        packages = search((*roots, *((folder, str(folder)) for folder in workspaces)))
        keys = private_keys_in(layers[0].parent, files)
        document = replace(document, private_keys=keys, packages=packages)
    return document, problems


def _may_use_packages(spec: Spec) -> bool:
    """False spares the search."""
    sketches = (one.sketch is not None for one in spec.types.values())
    return any(one.use is None for one in spec.programs.values()) or any(sketches)


def load_text(text: str, path: str, catalog: Catalog) -> tuple[Document | None, tuple[Diagnostic, ...]]:
    """Returns the text of one spec, and its warnings; with errors there is no document."""
    budget = LoadBudget()
    root, found = tree_of(text, Path(path), ProjectFiles.beside(Path(path), budget))
    return _document([root] if root is not None else [], found, path, budget, catalog)


def source_of_text(text: str, path: str) -> Source:
    """Returns the data and positions of one spec's text, with its includes and ranges."""
    budget = LoadBudget()
    root, _ = tree_of(text, Path(path), ProjectFiles.beside(Path(path), budget))
    joined, _ = _one([root] if root is not None else [], budget.texts)
    return source_of(joined, path, budget.texts)[0]


def _document(
    trees: Sequence[yaml.Node], found: Sequence[Diagnostic], path: str, budget: LoadBudget, catalog: Catalog
) -> tuple[Document | None, tuple[Diagnostic, ...]]:
    diagnostics = [*catalog.diagnostics, *found]
    if has_errors(found):  # what is missing then would bring false complaints
        return None, tuple(diagnostics)
    root, found = _one(trees, budget.texts)
    source, wrong = source_of(root, path, budget.texts)
    diagnostics += [*found, *wrong]
    if source.root is None or source.data is None:
        return None, tuple(diagnostics) if has_errors(diagnostics) else (*diagnostics, _empty(path))
    spec, problems = validated(Spec, source)
    diagnostics = _without_echoes([*diagnostics, *problems, *_homeless_codecs(spec, source)])
    if spec is None or has_errors(diagnostics):
        return None, tuple(diagnostics)
    return Document(spec, source, catalog), tuple(diagnostics)


def _homeless_codecs(spec: Spec | None, source: Source) -> list[Diagnostic]:
    """A protocol class stands beside the file of its type: a type within a spec has none."""
    return [
        Diagnostic(
            "CODEC001",
            f"the protocol class of `{name}` has no file to stand beside",
            source.span(("types", name, "protocol", "codec")),
            help=(f"move the type into a file of its own, robots/{name}.yaml, and the class to {name}.py",),
        )
        for name, one in (spec.types.items() if spec is not None else ())
        if isinstance(one.protocol, PythonProtocol)
    ]


def _one(trees: Sequence[yaml.Node], texts: Mapping[str, str]) -> tuple[yaml.Node | None, list[Diagnostic]]:
    """The one tree that the layers make; with wrong ranges there is none.

    Ranges are written out first, so that what is laid over a range may mean one of its elements.
    """
    diagnostics: list[Diagnostic] = []
    if any(ranges.may_stand_in(text) for text in texts.values()):
        written = [ranges.expand(tree) for tree in trees]
        trees, diagnostics = [tree for tree, _ in written], [one for _, found in written for one in found]
    if not trees or diagnostics:
        return None, diagnostics
    root = trees[0]
    for over in trees[1:]:
        root, found = overlaid(root, over)
        diagnostics += found
    return root, diagnostics


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
