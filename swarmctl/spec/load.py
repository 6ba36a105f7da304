"""Loads a spec file: returns a typed document with positions, or diagnostics."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from pathlib import Path

import yaml

from swarmctl.diagnostics import Diagnostic, Span, apart_from, drop_redundant_warnings, has_errors
from swarmctl.robot_types.any_robot_type import AnyRobotType, with_protocol
from swarmctl.robot_types.protocols import PythonProtocol
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.ros_driver import RosDriver
from swarmctl.robot_types.ros_robot_type import RosRobotType
from swarmctl.robot_types.settings import RobotSettings
from swarmctl.ros_packages.package import NO_PACKAGES, Packages
from swarmctl.rulebook import Severity
from swarmctl.spec import keystore, selection_expansion, variable_scopes, wireguard_keys
from swarmctl.spec.beside_files import NO_FILES, BesideFiles, read_beside
from swarmctl.spec.catalog import Catalog, load_catalog
from swarmctl.spec.delivered_files import read_delivered
from swarmctl.spec.model import Computer, Spec
from swarmctl.spec.package_search import Search, packages_in
from swarmctl.spec.private_keys import private_keys_in
from swarmctl.spec.selection_expansion import selections
from swarmctl.spec.validation import validated
from swarmctl.yamltext import ranges
from swarmctl.yamltext.compose import PLAIN, pairs_of, span_of
from swarmctl.yamltext.files import LoadBudget, Read, content
from swarmctl.yamltext.overlay import overlaid
from swarmctl.yamltext.project_files import ProjectFiles, tree_of
from swarmctl.yamltext.scalars import number_or_text
from swarmctl.yamltext.source import Source, source_of
from swarmctl.yamltext.variables import may_stand_in

CODE = "SPEC006"
CURRENT = 1


def version_finding(root: yaml.Node | None) -> Diagnostic | None:
    """Returns the error about a spec of a newer version than this swarmctl knows."""
    pairs = pairs_of(root) if isinstance(root, yaml.MappingNode) else {}
    _, node = pairs.get("version", (None, None))
    if not isinstance(node, yaml.ScalarNode) or node.tag != PLAIN or not node.value:
        return None
    version = number_or_text(node.value)
    if not isinstance(version, (int, float)) or version != version // 1 or version <= CURRENT:
        return None
    return Diagnostic(
        CODE,
        f"version {int(version)} of the spec format is newer than this swarmctl",
        span_of(node),
        help=(
            f"install a newer swarmctl: this one knows version {CURRENT} (`swarmctl --version`)",
            f"write `version: {CURRENT}` if the spec is of that version",
        ),
    )


_MISSING = "SPEC002"


@dataclass(frozen=True)
class Document:
    """A spec, where each of its words stands, and the catalog its names are looked up in."""

    spec: Spec
    source: Source
    catalog: Catalog
    private_keys: tuple[str, ...] = ()  # files beside the spec that are some
    packages: Packages = NO_PACKAGES  # the ROS packages beside the spec, and in the operator's workspaces
    files: BesideFiles = NO_FILES  # the files beside the spec that programs and robots get

    def span(self, *loc: str | int, key: bool = False) -> Span:
        """Returns the position of a value, or with ``key`` of its key."""
        return self.source.span(loc, key=key)

    @cached_property
    def types(self) -> Mapping[str, AnyRobotType]:
        """Robot types by name: the spec's own before the catalog's."""
        return self.catalog.types.under(self.spec.types)

    @property
    def own_types(self) -> Mapping[str, AnyRobotType]:
        """Robot types of the spec and of the files beside it, by name."""
        beside = {name: self.catalog.types[name] for name in self.catalog.sources}
        return {**beside, **self.spec.types}

    @property
    def own_native_types(self) -> Mapping[str, RobotType]:
        """Those of `own_types` that have a protocol."""
        return with_protocol(self.own_types)

    def span_of_type(self, name: str, *loc: str | int, key: bool = False) -> Span:
        """Returns the position of a value of one of `own_types`, in the spec or in its own file."""
        if name in self.spec.types:
            return self.source.span(("types", name, *loc), key=key)
        return self.catalog.sources[name].span(loc, key=key)

    @property
    def texts(self) -> Mapping[str, str]:
        """Every text of the spec and of the robot types beside it, by file."""
        types = (text for one in self.catalog.sources.values() for text in one.texts.items())
        return {**dict(types), **self.source.texts}

    @property
    def computers(self) -> Mapping[str, Computer]:
        """The computers of the catalog and of the spec, by name."""
        return {**self.catalog.computers, **self.spec.computers}

    def settings_layers(self, robot: str) -> tuple[RobotSettings, RobotSettings, RobotSettings]:
        """Returns the settings of a robot, from general to specific: `defaults`, its type, its own."""
        given = self.spec.robots[robot]
        of_type = self._settings_of_types.get(given.type)
        if of_type is None:
            robot_type = self.types[given.type]
            of_type = robot_type.settings if isinstance(robot_type, RobotType) else robot_type.settings_layer
            self._settings_of_types[given.type] = of_type
        return self.spec.defaults.robot, of_type, given.settings

    @cached_property
    def _settings_of_types(self) -> dict[str, RobotSettings]:
        """Those of types of robots, by type, as they are looked up."""
        return {}


@dataclass(frozen=True)
class Draft:
    """What the files of a spec hold, before it is validated, and what is wrong with the files themselves.

    Where a range or an overlay is wrong, ``root`` has something likely; where a file cannot be read, nothing.
    """

    root: yaml.Node | None
    path: str
    texts: Mapping[str, str]
    catalog: Catalog
    diagnostics: tuple[Diagnostic, ...] = ()
    private_keys: tuple[str, ...] = ()
    packages_for: Callable[[Spec], Packages] = lambda _: NO_PACKAGES  # searched when a document needs them
    files_for: Callable[[Spec], BesideFiles] = lambda _: NO_FILES  # read when a document needs them
    trees: Sequence[yaml.Node] = ()  # of the spec and of each file laid over it

    def document(self, spec: Spec, source: Source, catalog: Catalog) -> Document:
        """Returns the document of a spec that the draft makes."""
        packages, files = self.packages_for(spec), self.files_for(spec)
        return Document(spec, source, catalog, self.private_keys, packages, files)

    @property
    def is_readable(self) -> bool:
        """False without a spec, after too many ranges and in another version: what follows is unknown."""
        return self.root is not None and not any(one.code in ("RANGE003", CODE) for one in self._errors())

    @property
    def is_complete(self) -> bool:
        """False if an included file or an overlay could not be read, too."""
        unread = [one for one in self._errors() if one.code.startswith(("FILE", "INC", "YAML"))]
        return self.is_readable and all(one.code == "YAML002" for one in unread)

    def _errors(self) -> list[Diagnostic]:
        own = self.diagnostics[len(self.catalog.diagnostics) :]
        return [one for one in own if one.severity is Severity.ERROR]


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
    return document_of(draft_of(layers, read, workspaces, search))


def load_text(text: str, path: str, catalog: Catalog) -> tuple[Document | None, tuple[Diagnostic, ...]]:
    """Returns the text of one spec, and its warnings; with errors there is no document."""
    budget = LoadBudget()
    root, found = tree_of(text, Path(path), ProjectFiles.beside(Path(path), budget))
    return document_of(_draft([root] if root is not None else [], found, path, budget, catalog))


def draft_of(
    layers: Sequence[Path],
    read: Read = content,
    workspaces: Sequence[Path] = (),
    search: Search = packages_in,
) -> Draft:
    """Reads the files of one spec, as `load` does."""
    budget = LoadBudget()
    trees: list[yaml.Node] = []
    diagnostics: list[Diagnostic] = []
    for path in layers:
        files = ProjectFiles.beside(path, budget, read)
        text = files.named(path)
        root, found = (None, [text]) if isinstance(text, Diagnostic) else tree_of(text, path, files)
        diagnostics += found
        if root is None and not trees:
            break  # without a spec there is nothing to lay a file over
        trees += [root] if root is not None else []
    files, folder = ProjectFiles.beside(layers[0], budget, read), layers[0].parent
    catalog = load_catalog(folder / "robots", files, budget.texts)
    draft = _draft(trees, diagnostics, str(layers[0]), budget, catalog)
    keys = private_keys_in(folder, files)
    return replace(
        draft,
        private_keys=keys,
        packages_for=_packages_for(files, workspaces, search, catalog),
        files_for=lambda spec: _files_of(spec, folder, files, catalog),
    )


def _files_of(spec: Spec, folder: Path, files: ProjectFiles, catalog: Catalog) -> BesideFiles:
    paths = [path for program in spec.programs.values() for path in program.beside]
    types = (*spec.types.values(), *(catalog.types[name] for name in catalog.sources))
    paths += [*keystore.paths(spec), *wireguard_keys.paths(spec)]
    paths += [one.urdf for one in (*spec.robots.values(), *types) if one.urdf is not None]
    return read_beside(folder, paths, files) if paths else NO_FILES


def _packages_for(
    files: ProjectFiles, workspaces: Sequence[Path], search: Search, catalog: Catalog
) -> Callable[[Spec], Packages]:
    """Returns the search for the packages of a spec, which searches once."""
    known = cache(search)

    def found(spec: Spec) -> Packages:
        roots = [(Path(files.root), "")] if files.root and _may_use_packages(spec, catalog) else []
        seen = known((*roots, *((folder, str(folder)) for folder in workspaces)))
        if not spec.packages:
            return seen
        delivered, refused = read_delivered(Path(files.root or "."), spec.packages, files)
        return replace(seen, delivered=delivered, refused=refused)

    return found


def _may_use_packages(spec: Spec, catalog: Catalog) -> bool:
    """Whether packages are needed."""
    if any(one.use is None for one in spec.programs.values()):
        return True
    if any(isinstance(one, RobotType) and one.sketch is not None for one in spec.types.values()):
        return True
    types = catalog.types.under(spec.types)
    return any(
        isinstance(types.get(one.type), RosRobotType) or isinstance(one.driver, RosDriver)
        for one in spec.robots.values()
    )


def source_of_text(text: str, path: str) -> Source:
    """Returns the data and positions of one spec's text, with its includes and ranges."""
    budget = LoadBudget()
    root, _ = tree_of(text, Path(path), ProjectFiles.beside(Path(path), budget))
    joined, _, _ = _one([root] if root is not None else [], budget.texts)
    return source_of(joined, path, budget.texts)[0]


def _draft(
    trees: Sequence[yaml.Node], found: Sequence[Diagnostic], path: str, budget: LoadBudget, catalog: Catalog
) -> Draft:
    root, trees, wrong = _one(trees, budget.texts)
    if has_errors(found):  # an overlay may change what was not read, which may set variables
        wrong = [one for one in wrong if not one.code.startswith(("OVER", "VAR"))]
    if (other_version := version_finding(root)) is not None:
        wrong.append(other_version)
    diagnostics = (*catalog.diagnostics, *found, *wrong)
    trees = trees if len(trees) > 1 or any(one is not root for one in trees) else ()
    return Draft(root, path, budget.texts, catalog, diagnostics, trees=trees)


def document_of(draft: Draft) -> tuple[Document | None, tuple[Diagnostic, ...]]:
    """Returns the document that a draft makes, and its warnings; with errors there is no document."""
    source, wrong = source_of(draft.root, draft.path, draft.texts, draft.trees)
    diagnostics = [*draft.diagnostics, *wrong]
    if not draft.is_readable or source.data is None:
        return None, tuple(diagnostics) if has_errors(diagnostics) else (*diagnostics, _empty(draft.path))
    spec, problems = validated(Spec, source)
    _share_key_sets(spec)
    if not draft.is_complete:
        problems = [one for one in problems if one.code != _MISSING]  # a file that is not read may have it
    problems += homeless_codecs(spec, source)
    diagnostics = drop_redundant_warnings([*diagnostics, *apart_from(diagnostics, problems)])
    if spec is None or has_errors(diagnostics):
        return None, tuple(diagnostics)
    return draft.document(spec, source, draft.catalog), tuple(diagnostics)


def _share_key_sets(spec: Spec | None) -> None:
    """Makes equal robots and hosts share the set of their keys: some 200 bytes of each."""
    known: dict[frozenset[str], set[str]] = {}
    for one in (*spec.robots.values(), *spec.hosts.values()) if spec else ():
        keys = one.__pydantic_fields_set__
        object.__setattr__(one, "__pydantic_fields_set__", known.setdefault(frozenset(keys), keys))


def homeless_codecs(spec: Spec | None, source: Source) -> list[Diagnostic]:
    """A protocol class stands beside the file of its type: a type within a spec has none."""
    return [
        Diagnostic(
            "CODEC001",
            f"the protocol class of `{name}` has no file to stand beside",
            source.span(("types", name, "protocol", "codec")),
            help=(f"move the type into a file of its own, robots/{name}.yaml, and the class to {name}.py",),
        )
        for name, one in (spec.types.items() if spec is not None else ())
        if isinstance(one, RobotType) and isinstance(one.protocol, PythonProtocol)
    ]


def _one(
    trees: Sequence[yaml.Node], texts: Mapping[str, str]
) -> tuple[yaml.Node | None, Sequence[yaml.Node], list[Diagnostic]]:
    """The one tree that the layers make, and their own, with what is wrong.

    Ranges are written out first, so that what is laid over a range may mean one of its elements. Variables
    are replaced in what the layers make, so that one of them may have the values.
    """
    diagnostics: list[Diagnostic] = []
    if any(ranges.may_stand_in(text) for text in texts.values()):
        written = [ranges.expand(tree, selections(tree)) for tree in trees]
        trees, diagnostics = [tree for tree, _ in written], [one for _, found in written for one in found]
    if not trees:
        return None, trees, diagnostics
    root = trees[0]
    for over in trees[1:]:
        root, found = overlaid(root, over)
        diagnostics += found
    may_vary = any(map(may_stand_in, texts.values()))
    written_out, wrong = (variable_scopes if may_vary else selection_expansion).expand(root)
    return written_out, trees, [*diagnostics, *wrong]


def _empty(path: str) -> Diagnostic:
    return Diagnostic(
        "SPEC004",
        "there is nothing in this file",
        Span(path, 1, 1, 1, 1),
        help=("a spec begins like: version: 1, name: lab, mode: leader, then hosts, robots and links",),
    )
