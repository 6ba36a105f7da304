"""What the actions of a launch file of ROS 2 start.

Source: github.com/ros2/launch and launch_ros, the actions and substitutions of Humble to Kilted. What only a
host, a running launch or Python knows is unknown, with the reason.
"""

from __future__ import annotations

import copy
import json
import posixpath
import re
import shlex
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

from swarmctl.ros_packages.launch_files import Include, Launched, Node, Place, Setting
from swarmctl.ros_packages.launch_values import (
    Action,
    Computed,
    NotReadError,
    Reader,
    Rewritten,
    Text,
    Unknown,
    Variable,
)
from swarmctl.ros_packages.package import Package
from swarmctl.ros_packages.parameter_sections import flat, loaded, sections
from swarmctl.ros_packages.parameters import reads_section

_MAX_INCLUDES = 16  # nested
_LONGEST = 500  # characters of a value
_LARGEST = 1 << 64
_LONGEST_LIST = 4000  # characters of a list as text
_SHARE = re.compile(r"\$\(find-pkg-share ([A-Za-z0-9_-]+)\)/+([^$]+)")
_OF_NODES = {
    "prefix": "", "respawn": ": systemd restarts programs", "respawn_delay": "",
    "respawn_max_retries": "", "cwd": "", "ros_args": "", "ros_arguments": "", "exec_name": "", "on_exit": "",
    "shell": "", "sigterm_timeout": "", "sigkill_timeout": "", "extra_arguments": "", "extra_args": "",
}  # fmt: skip
_WORD = re.compile(r"\w+")
_TRUE, _FALSE = ("true", "1"), ("false", "0")


@dataclass
class _Scope:
    """What holds for a file or a group."""

    package: Package
    path: str  # of the file, within the package
    values: dict[str, str | Unknown]  # launch configurations
    namespace: str | Unknown = ""
    remaps: tuple[tuple[str, str], ...] = ()
    parameters: tuple[Setting, ...] = ()
    environment: tuple[Setting, ...] = ()
    certain: bool = True
    condition: str = ""
    depth: int = 0
    leaked: dict[str, str] = field(default_factory=dict)  # values that an included file sets, with its path

    def inner(self) -> _Scope:
        """Returns a scope whose changes end with it."""
        return replace(self, values=dict(self.values), leaked=dict(self.leaked))


def evaluate(
    package: Package,
    path: str,
    packages: Mapping[str, Package],
    readers: Mapping[str, Reader],
    *,
    limit: int,
    arguments: Mapping[str, str | None] = MappingProxyType({}),
    closed: Mapping[str, str] = MappingProxyType({}),
) -> Launched:
    """Returns what a launch file starts, with the includes that are here.

    ``arguments`` go before the defaults that it declares. ``readers`` has one for each suffix of a launch
    file. It ends after ``limit`` actions. Includes of the files ``closed``, each with its package, are not
    read.
    """
    run = _Run(packages, readers, limit, closed)
    given = {name: Unknown("a script") if one is None else one for name, one in arguments.items()}
    scope = _Scope(package, path, dict(given))
    run.file(scope, Place(posixpath.join(package.folder, path), 0))
    run.end(0)
    if run.left <= 0:
        place = Place(posixpath.join(package.folder, path), 0)
        run.launched.left_out.append((place, "it has more, with its includes, than is read"))
    run.launched.cost = limit - run.left
    words = Counter(run.read_words)
    for place, (name, value) in run.declared.items():
        shown = f" (`{value}`)" if value and isinstance(value, str) else ""
        if name not in run.used and words[name] < 2:  # a second time is another use, whatever it is
            run.launched.left_out.append((place, f"no node here uses the argument {name}{shown}"))
        elif name not in run.used and run.launched.includes:
            why = f"no node here uses the argument {name}{shown}; a file that is included may do so"
            run.launched.left_out.append((place, why))
    return run.launched


class _Run:
    def __init__(
        self,
        packages: Mapping[str, Package],
        readers: Mapping[str, Reader],
        limit: int,
        closed: Mapping[str, str],
    ) -> None:
        self.packages, self.readers, self.left, self.closed = packages, readers, limit, closed
        self.launched = Launched()
        self.has_output = False  # an argument of a node
        self.parsed: dict[Place, Any] = {}  # files of YAML
        self.replaced: dict[str, Mapping[str, str]] = {}  # texts in values of files of parameters
        self.declared: dict[Place, tuple[str, str | Unknown]] = {}  # launch configurations
        self.used: set[str] = set()
        self.read_words: list[str] = []  # of all files that were read
        self.pushed: list[tuple[Place, str, int]] = []  # namespaces, each with what was started before
        self.kinds: Mapping[str, Callable[[_Scope, Action], None]] = {
            "arg": self.argument, "let": self.let, "unset": self.unset, "group": self.group,
            "children": self.children_of, "namespace": self.push, "node": self.node,
            "container": self.container, "load": self.load, "include": self.include,
            "remap": self.remap, "parameter": self.parameter, "environment": self.set_environment,
            "silent": lambda _scope, _action: None, "later": self.later, "opaque": self.opaque,
            "process": self.process,
        }  # fmt: skip

    def place(self, scope: _Scope, line: int) -> Place:
        return Place(posixpath.join(scope.package.folder, scope.path), line)

    def not_read(self, scope: _Scope, line: int, why: str) -> None:
        self.launched.left_out.append((self.place(scope, line), why))

    def file(self, scope: _Scope, at: Place) -> None:
        content = scope.package.contents.get(scope.path)
        reader = next((one for end, one in self.readers.items() if scope.path.endswith(end)), None)
        if content is None or reader is None or self.left <= 0:
            return
        self.launched.files[at.file] = None
        try:
            text = content.decode("utf-8", "replace")
            written = reader(text, lambda file: self.code_reads(scope, file))
        except NotReadError as error:
            self.not_read(scope, error.line, str(error))
            return
        self.read_words += _WORD.findall(text)
        try:
            self.actions(scope, written.actions)
        except RecursionError:
            self.not_read(scope, 0, "it is nested too deeply")
        for line, why in written.unread.items():  # also of functions that a running launch calls
            self.not_read(scope, line, why)

    def actions(self, scope: _Scope, actions: Any, depth: int = 0) -> None:
        for one in actions if isinstance(actions, (list, tuple)) else [actions]:
            self.left -= 1
            if self.left <= 0 or depth > _MAX_INCLUDES:
                return
            if isinstance(one, (list, tuple)):
                self.actions(scope, one, depth + 1)
            elif isinstance(one, Action):
                self.action(scope, one)
            elif isinstance(one, Unknown):
                self.not_read(scope, one.line, f"what is started depends on {one.why}")

    def action(self, scope: _Scope, action: Action) -> None:
        within = scope
        if action.condition is not None:
            value = self.text(scope, action.condition.value)
            applies = _is_true(value)
            if applies is None:
                why = value.why if isinstance(value, Unknown) else f"`{value}`"
                within = replace(scope.inner(), certain=False, condition=scope.condition or why)
                self.launched.unknown.setdefault((self.place(scope, action.line), "if"), within.condition)
            elif applies is not action.condition.wanted:
                self.not_read(scope, action.line, "it is not started: its condition is not true")
                return
        if within is not scope and action.kind in ("remap", "parameter", "environment"):
            return  # whether it applies is to fill in
        self.kinds[action.kind](within, action)
        if within is not scope:  # what it sets is not known
            changed = [name for name, one in within.values.items() if one != scope.values.get(name)]
            scope.values.update(dict.fromkeys(changed, Unknown(within.condition)))
            if within.namespace != scope.namespace:
                scope.namespace = Unknown(within.condition)

    # Values

    def text(self, scope: _Scope, value: Any) -> str | Unknown:
        """Returns a value as text, as launch substitutes it."""
        self.left -= 1
        if isinstance(value, Unknown) or self.left <= 0:
            return value if isinstance(value, Unknown) else Unknown("too much to evaluate")
        if isinstance(value, Variable):
            self.used.add(value.name)
            found = scope.values.get(value.name)
            if found is None and value.default is not None:
                return self.text(scope, value.default)
            return Unknown(f"the argument `{value.name}`") if found is None else found
        if isinstance(value, Computed):
            return self.computed(scope, value)
        if isinstance(value, Rewritten):
            return self.text(scope, value.source)
        if isinstance(value, (Text, list, tuple)):
            parts = [self.text(scope, one) for one in (value.parts if isinstance(value, Text) else value)]
            if unknown := next((one for one in parts if isinstance(one, Unknown)), None):
                return unknown
            text = "".join(str(one) for one in parts)
        elif isinstance(value, bool):
            text = "true" if value else "false"
        elif isinstance(value, int) and abs(value) > _LARGEST:
            return Unknown("a large number")
        elif isinstance(value, (str, int, float)):
            text = str(value)
        else:
            return Unknown("what it computes")
        return text if len(text) <= _LONGEST else Unknown("a value that is too long")

    def computed(self, scope: _Scope, value: Computed) -> str | Unknown:
        parts = [self.text(scope, one) for one in value.parts]
        if unknown := next((one for one in parts if isinstance(one, Unknown)), None):
            return unknown
        if callable(value.operation):
            return value.operation("".join(map(str, parts)))
        if value.operation == "has":
            data = self.data(scope, str(parts[0]))[1]
            return str(parts[1] in data) if isinstance(data, Mapping) else Unknown(f"the file {parts[0]}")
        if value.operation == "replace":
            pairs = zip(parts[2::2], parts[3::2], strict=True) if _is_true(parts[1]) else ()
            self.replaced[str(parts[0])] = {str(old): str(new) for old, new in pairs}
            return parts[0]
        truths = [_is_true(one) for one in parts]
        if value.operation == "equals":
            return str(parts[0] == parts[-1]).lower()
        if value.operation == "if":
            return parts[1] if truths[0] else parts[2]
        found = all(truths) if value.operation == "and" else any(truths)
        return str(not found if value.operation == "not" else found).lower()

    def field(self, scope: _Scope, action: Action, key: str, shown: str) -> str | None:
        """The text of an argument, empty if it is left out; None if it is not known."""
        if action.arguments.get(key) is None:
            return ""
        found = self.text(scope, action.arguments[key])
        if isinstance(found, Unknown):
            self.launched.unknown.setdefault((self.place(scope, action.line), shown), found.why)
            return None
        return found

    # Actions

    def argument(self, scope: _Scope, action: Action) -> None:
        name = self.text(scope, action.arguments.get("name"))
        if isinstance(name, Unknown):
            return
        default = action.arguments.get("default")
        value = Unknown(f"the argument `{name}`") if default is None else self.text(scope, default)
        if name not in scope.values:
            scope.values[name] = value
        elif name in scope.leaked and default is not None and value != scope.values[name]:
            why = f"{scope.leaked[name]}, which is included before in the same scope, sets it otherwise"
            self.not_read(scope, action.line, f"the default of {name} is not used: {why}")
        self.declared[self.place(scope, action.line)] = (name, scope.values[name])
        if not scope.depth:
            known = scope.values[name]
            self.launched.arguments[name] = None if isinstance(known, Unknown) else known

    def let(self, scope: _Scope, action: Action) -> None:
        name = self.text(scope, action.arguments.get("name"))
        if not isinstance(name, Unknown):
            value = self.text(scope, action.arguments.get("value", ""))
            self.declared[self.place(scope, action.line)] = (name, value)
            scope.values[name] = value

    def unset(self, scope: _Scope, action: Action) -> None:
        name = self.text(scope, action.arguments.get("name"))
        if not isinstance(name, Unknown):
            scope.values.pop(name, None)

    def group(self, scope: _Scope, action: Action) -> None:
        scoped = self.text(scope, action.arguments.get("scoped", True))
        inner = scope if _is_true(scoped) is False else scope.inner()
        for name, value in _pairs(action.arguments.get("values")):
            key = str(self.text(scope, name))
            inner.values[key] = self.text(scope, value)
            self.declared[self.place(scope, action.line)] = (key, inner.values[key])
        first = len(self.pushed)
        self.actions(inner, action.arguments.get("actions", ()))
        self.end(first)

    def end(self, first: int) -> None:
        """Lists namespaces of a scope that ends, from number ``first`` on, in which nothing starts."""
        for place, namespace, started in self.pushed[first:]:
            if started == self.started():
                self.launched.left_out.append((place, f"nothing starts in the namespace {namespace}"))
        del self.pushed[first:]

    def started(self) -> int:
        """How much starts in namespaces so far: not processes, which are in none."""
        return sum(node.package != "" for node in self.launched.nodes) + len(self.launched.includes)

    def push(self, scope: _Scope, action: Action) -> None:
        started = self.started()
        namespace = str(self.text(scope, action.arguments.get("namespace", "")))
        place = self.place(scope, action.line)
        self.pushed.append((place, namespace, started))
        if isinstance(scope.namespace, Unknown):
            why = f"the namespace {namespace} is within one that is not known"
            self.launched.left_out.append((place, why))
        scope.namespace = self.joined(scope, action.arguments.get("namespace", ""))

    def joined(self, scope: _Scope, value: Any) -> str | Unknown:
        """A namespace within that of the scope, without slashes around it."""
        found = self.text(scope, value)
        if isinstance(found, Unknown) or found.startswith("/"):
            return found if isinstance(found, Unknown) else found.strip("/")
        if isinstance(scope.namespace, Unknown):
            return scope.namespace
        return "/".join(one for one in (scope.namespace, found.strip("/")) if one)

    def node(self, scope: _Scope, action: Action) -> None:
        place = self.place(scope, action.line)
        arguments = action.arguments
        package = self.field(scope, action, "package", "pkg")
        executable = self.field(scope, action, "executable", "exec")
        name = self.field(scope, action, "name", "name")
        namespace = self.joined(scope, arguments.get("namespace") or "")
        if isinstance(namespace, Unknown):
            self.launched.unknown.setdefault((place, "namespace"), namespace.why)
        called = name if name is None else name or self.called(scope, action, executable)
        unknown = called is None or isinstance(namespace, Unknown)
        if package:
            self.launched.packages.setdefault(package, place)
        words, is_whole = self.words(scope, action)
        self.launched.nodes.append(
            Node(
                None if unknown else f"/{namespace}/{called}" if namespace else f"/{called}",
                package,
                executable or None,
                (*scope.remaps, *self.remaps(scope, action)),
                place,
                scope.certain,
                arguments=words,
                is_whole=is_whole,
                parameters=(*scope.parameters, *self.settings(scope, action, called or "")),
                environment=(*scope.environment, *self.variables(scope, action)),
                has_name=name != "",
                last=called,
                is_component=action.kind == "component",
            )
        )
        if scope.condition:
            self.launched.unknown.setdefault((place, "if"), scope.condition)
        self.unkeyed(scope, action)

    def process(self, scope: _Scope, action: Action) -> None:
        """A command that is no node: it runs on its own, but one of `ros2` that ends."""
        place, given = self.place(scope, action.line), action.arguments.get("cmd")
        words = [self.text(scope, one) for one in _items(given)]
        known = [one for one in words if isinstance(one, str)]
        if _is_true(self.text(scope, action.arguments.get("shell", False))):
            words = ["bash", "-c", " ".join(known)] if len(known) == len(words) else words
        elif not isinstance(given, (list, tuple)) and known:
            try:
                words = list(shlex.split(known[0]))
            except ValueError:
                words = []
        first = words[0] if words else ""
        ends = posixpath.basename(str(first)) == "ros2" and words[1:2] not in (["bag"], ["run"], ["launch"])
        if not isinstance(first, str) or not first or ends:
            shown = " ".join(one if isinstance(one, str) else "..." for one in words)[:60]
            self.not_read(scope, action.line, f"it runs `{shown}`" if shown else "it runs a process")
            return
        rest, is_whole = self.known_words(scope, action, words[1:])
        if scope.condition:
            self.launched.unknown.setdefault((place, "if"), scope.condition)
        name = self.field(scope, action, "name", "name") or posixpath.basename(first)
        self.launched.nodes.append(
            Node(
                f"/{name}", "", first, (), place, scope.certain,
                arguments=rest, is_whole=is_whole,
                environment=(*scope.environment, *self.variables(scope, action)),
                has_name=bool(action.arguments.get("name")),
            )
        )  # fmt: skip
        self.unkeyed(scope, replace(action, arguments={**action.arguments, "shell": None}))

    def unkeyed(self, scope: _Scope, action: Action) -> None:
        """Lists arguments of a node that have no counterpart in a spec."""
        for key, what in _OF_NODES.items():
            if action.arguments.get(key) not in (None, False, "false", ""):
                value = self.text(scope, action.arguments[key])
                shown = f" (`{value}`)" if isinstance(value, str) else ""
                self.not_read(scope, action.line, f"its {key}{shown}{what}")
        if action.arguments.get("output") and not self.has_output:
            self.has_output = True
            why = "the journal of a host has what its programs print"
            self.not_read(scope, action.line, f"output of this node and of others: {why}")

    def remaps(self, scope: _Scope, action: Action) -> Iterator[tuple[str, str]]:
        for pair in _items(action.arguments.get("remappings")):
            ends = [self.text(scope, one) for one in pair] if isinstance(pair, (list, tuple)) else [pair]
            if len(ends) == 2 and all(isinstance(one, str) for one in ends):
                yield str(ends[0]), str(ends[1])
            else:
                why = next((one.why for one in ends if isinstance(one, Unknown)), "what it computes")
                self.not_read(scope, action.line, f"a remapping depends on {why}")

    def words(self, scope: _Scope, action: Action) -> tuple[str | None, bool]:
        """The words of the command line as one text, quoted for a shell, and whether all are known."""
        given = action.arguments.get("arguments")
        if not isinstance(given, (list, tuple)):  # of XML and YAML: one text
            text = self.field(scope, action, "arguments", "args")
            return text, text is not None
        words = [self.text(scope, one) for one in _items(given)]
        return self.known_words(scope, action, words)

    def known_words(
        self, scope: _Scope, action: Action, words: Sequence[str | Unknown]
    ) -> tuple[str | None, bool]:
        """Words as one text, in which `...` stands for those that are not known; None if no word is."""
        unknown = next((one for one in words if isinstance(one, Unknown)), None)
        if unknown is not None:
            self.launched.unknown.setdefault((self.place(scope, action.line), "args"), unknown.why)
        if words and all(isinstance(one, Unknown) for one in words):
            return None, False
        texts = [one if isinstance(one, str) else "..." for one in words]
        return shlex.join(texts), unknown is None

    def settings(self, scope: _Scope, action: Action, name: str) -> Iterator[Setting]:
        for one in _items(action.arguments.get("parameters")):
            if isinstance(one, Mapping):
                yield from self.flat(scope, action.line, "", one)
            elif isinstance(one, Rewritten):
                for setting in self.of_file(scope, action, self.text(scope, one.source), name, one.root):
                    key = next((key for key in one.rewrites if setting.name.split(".")[-1] == key), "")
                    known = {"value": self.text(scope, one.rewrites[key]), "type": "yaml"} if key else {}
                    is_known = not isinstance(known.get("value"), Unknown)
                    yield replace(setting, **known if is_known else {"value": None})
            else:
                yield from self.of_file(scope, action, self.text(scope, one), name)

    def data(self, scope: _Scope, file: str) -> tuple[Place | None, Any]:
        """The place of a file of YAML, and what it has; no place if it is not here."""
        package, path = self.target(scope, file)
        found = self.packages.get(package) if package else scope.package
        content = found.contents.get(path) if found else None
        if found is not None and content is not None:
            place = Place(posixpath.join(found.folder, path), 0)
        else:
            match = _SHARE.fullmatch(file)
            end = f"/{match[1]}/{path}" if match else f"/{posixpath.basename(file)}"
            same = self.files_at(end) if match or file.startswith(("/", "~")) else {}
            if len(same) != 1:
                return None, None
            place, content = next(iter(same.items()))
        if place not in self.parsed:
            self.parsed[place] = loaded(content)
        return place, self.parsed[place]

    def files_at(self, end: str) -> Mapping[Place, bytes]:
        """The files whose path ends so."""
        found: dict[Place, bytes] = {}
        for package in self.packages.values():
            for path, content in package.contents.items():
                whole = posixpath.normpath(posixpath.join(package.folder, path))
                if f"/{whole}".endswith(end):
                    found[Place(whole, 0)] = content
        return found

    def code_reads(self, scope: _Scope, file: Any) -> Any:
        """What a file has that the code of a launch file reads."""
        name = self.text(scope, file)
        place, data = (None, None) if isinstance(name, Unknown) else self.data(scope, name)
        try:
            data = copy.deepcopy(data)  # the code may change it
        except RecursionError:
            data = None
        if place is None or data is None:
            return Unknown(
                f"the file {name}" if isinstance(name, str) else f"a file, whose path depends on {name.why}"
            )
        self.launched.files[place.file] = None
        why = f"{self.place(scope, 0)} reads it; the draft has only what nodes get of it"
        self.launched.left_out.append((place, why))
        return data

    def called(self, scope: _Scope, action: Action, executable: str | None) -> str | None:
        """The name of a node without one: that in its parameter files, else that of its executable."""
        package = self.text(scope, action.arguments.get("package"))
        for one in _items(action.arguments.get("parameters")):
            file = self.text(scope, one.source if isinstance(one, Rewritten) else one)
            data = None if isinstance(file, Unknown) else self.data(scope, file)[1]
            names = [key.rpartition("/")[2] for key, _ in sections(data)]
            names = [name for name in names if name.isidentifier()]
            words = {*str(executable).split("_"), *str(package).split("_")} - {"node"}
            alike = [name for name in names if words & {*name.split("_")}]
            if executable not in names and (package in names or len(alike) == len(names) == 1):
                return str(package) if package in names else names[0]
        return executable

    def of_file(
        self, scope: _Scope, action: Action, file: str | Unknown, name: str, root: Any = ""
    ) -> Iterator[Setting]:
        """The parameters of a node in a file, as rcl reads them; a file that is not here is not read."""
        if isinstance(file, Unknown):
            self.not_read(scope, action.line, f"its parameter file depends on {file.why}")
            return
        namespace = self.joined(scope, action.arguments.get("namespace") or "")
        around = self.text(scope, root)
        known = not isinstance(namespace, Unknown) and not isinstance(around, Unknown)
        full = f"/{namespace}/{name}" if known and namespace else f"/{name}"
        place, data = self.data(scope, file)
        if place is None:
            self.not_read(scope, action.line, f"its parameters of {file}, which is not here")
            return
        if not isinstance(data, Mapping):
            self.not_read(scope, action.line, f"its parameters of {file}, which is no YAML of parameters")
            return
        if file.startswith(("/", "~")):
            self.not_read(scope, action.line, f"{file}: {place}, which is called so, is taken for it")
        self.launched.files[place.file] = None
        for section, values in sorted(sections(data), key=lambda one: "*" not in one[0]):
            whole = f"/{around.strip('/')}{section}" if isinstance(around, str) and around else section
            is_read = reads_section(whole, full) if known else section.rpartition("/")[2] in (name, "*", "**")
            before = self.launched.sections.get((place.file, section))
            self.launched.sections[place.file, section] = bool(before) or is_read
            for key, value in flat(values) if is_read else ():
                self.left -= 1
                if self.left <= 0:  # a file whose anchors repeat each other has no end
                    self.not_read(scope, action.line, f"of {file} there is too much to read")
                    return
                yield self.setting(scope, place, key, self.with_replaced(file, value))

    def with_replaced(self, file: str, value: Any) -> Any:
        for old, new in self.replaced.get(file, {}).items():
            value = value.replace(old, new) if isinstance(value, str) else value
        return value

    def flat(self, scope: _Scope, line: int, prefix: str, values: Mapping[Any, Any]) -> Iterator[Setting]:
        place = self.place(scope, line)
        for key, value in values.items():
            name = self.text(scope, key)
            if self.left <= 0:
                return
            if isinstance(name, Unknown):
                self.not_read(scope, line, f"the name of a parameter depends on {name.why}")
            elif isinstance(value, Mapping):
                if len(prefix) < _LONGEST:
                    yield from self.flat(scope, line, f"{prefix}{name}.", value)
            else:
                yield self.setting(scope, place, f"{prefix}{name}", value)

    def setting(self, scope: _Scope, place: Place, name: str, value: Any) -> Setting:
        """A parameter with the type that launch_ros gives it: text with a substitution is read as YAML."""
        kinds = {bool: "bool", int: "int", float: "double", str: "str"}
        if value in ([], ()):
            value = Unknown("an empty list, which has no type")
        if isinstance(value, (list, tuple)) and all(type(one) in kinds for one in value) and value:
            if any(isinstance(one, str) for one in value) and not all(isinstance(one, str) for one in value):
                value = Text(tuple(value))
            else:
                text = json.dumps(list(value))
                return Setting(name, text if len(text) <= _LONGEST_LIST else None, place, "yaml")
        found = self.text(scope, value)
        if isinstance(found, Unknown):
            self.launched.unknown.setdefault((place, name), found.why)
            return Setting(name, None, place)
        return Setting(name, found, place, kinds.get(type(value), "yaml"))

    def variables(self, scope: _Scope, action: Action) -> Iterator[Setting]:
        place = self.place(scope, action.line)
        for key in ("env", "additional_env"):
            for name, value in _pairs(action.arguments.get(key)):
                known = self.text(scope, name)
                if isinstance(known, Unknown):
                    self.not_read(scope, action.line, f"the name of a variable depends on {known.why}")
                else:
                    yield self.variable(place, known, self.text(scope, value))

    def children_of(self, scope: _Scope, action: Action) -> None:
        if (period := action.arguments.get("period")) is not None:
            value = self.text(scope, period)
            shown = value if isinstance(value, str) else "?"
            self.not_read(scope, action.line, f"its period of {shown} s; programs start when they can")
        self.actions(scope, action.arguments.get("actions", ()))

    def container(self, scope: _Scope, action: Action) -> None:
        self.not_read(scope, action.line, "a container of components, of which each runs on its own")
        self.components(scope, action)

    def load(self, scope: _Scope, action: Action) -> None:
        self.text(scope, action.arguments.get("target_container", action.arguments.get("target")))
        self.not_read(scope, action.line, "its container: each component runs on its own")
        self.components(scope, action)

    def components(self, scope: _Scope, action: Action) -> None:
        for one in _items(action.arguments.get("components")):
            if isinstance(one, Action):
                own = {**one.arguments, "executable": one.arguments.get("plugin")}
                self.node(scope, replace(one, kind="component", arguments=own))

    def include(self, scope: _Scope, action: Action) -> None:
        place = self.place(scope, action.line)
        file = self.field(scope, action, "file", "file")
        given: dict[str, str | Unknown] = {}
        inner = scope.inner()  # each argument may use those before it
        for name, one in _pairs(action.arguments.get("arguments")):
            known = self.text(inner, name)
            if isinstance(known, Unknown):
                self.not_read(scope, action.line, f"the name of an argument depends on {known.why}")
                continue
            key = known
            given[key] = inner.values[key] = self.text(inner, one)
            for changed, value in one.rewrites.items() if isinstance(one, Rewritten) else ():
                text = self.text(scope, value)
                equals = f" = {text}" if isinstance(text, str) else ""
                why = f"`{changed}{equals}`, which a copy of {key} gets; write it in the file"
                self.not_read(scope, action.line, why)
        package, path = self.target(scope, file) if file is not None else ("", "")
        found = self.packages.get(package) if package else scope.package
        shown = posixpath.normpath(posixpath.join(found.folder, path)) if found else ""
        if shown in self.closed:
            self.launched.files[shown] = None
            package = self.closed[shown]
        elif found is not None and path in found.contents and scope.depth < _MAX_INCLUDES:
            leaked = {name: by for name, by in scope.leaked.items() if name not in given}
            values = {**scope.values, **given}
            within = replace(
                scope, package=found, path=path, values=values, depth=scope.depth + 1, leaked=leaked
            )
            self.file(within, Place(posixpath.join(found.folder, path), 0))
            self.leave(scope, within)
            return
        scope.values.update(given)
        self.add_include(scope, action, Include(package, path, None, {}, place, scope.certain), given)

    @staticmethod
    def leave(scope: _Scope, inner: _Scope) -> None:
        """Keeps what an included file sets: an include is no scope, as a group is."""
        file = posixpath.normpath(posixpath.join(inner.package.folder, inner.path))
        scope.leaked |= {
            name: inner.leaked.get(name, file)
            for name, value in inner.values.items()
            if scope.values.get(name) != value
        }
        scope.values.update(inner.values)
        scope.namespace, scope.remaps = inner.namespace, inner.remaps
        scope.parameters, scope.environment = inner.parameters, inner.environment

    def add_include(
        self, scope: _Scope, action: Action, include: Include, given: Mapping[str, str | Unknown]
    ) -> None:
        """Adds an include of a file that is not here, and lists what around it is not passed on."""
        place = include.place
        if scope.condition:
            self.launched.unknown.setdefault((place, "if"), scope.condition)
        if isinstance(scope.namespace, Unknown):
            self.launched.unknown.setdefault((place, "namespace"), scope.namespace.why)
        for old, new in scope.remaps:
            why = f"it has no remap from {old} to {new}; write it in its launch file"
            self.not_read(scope, action.line, why)
        for setting in scope.parameters:
            why = f"it has no parameter {setting.name}; write it in its launch file"
            self.not_read(scope, action.line, why)
        for key, one in given.items():
            if isinstance(one, Unknown):
                self.launched.unknown.setdefault((place, f"argument {key}"), one.why)
        namespace = None if isinstance(scope.namespace, Unknown) else scope.namespace
        arguments = {key: None if isinstance(one, Unknown) else one for key, one in given.items()}
        found = replace(include, namespace=namespace, arguments=arguments, environment=scope.environment)
        self.launched.includes.append(found)

    def target(self, scope: _Scope, file: str) -> tuple[str, str]:
        """The package and the path within it of an included file; no package for one beside this file."""
        if match := _SHARE.fullmatch(file):
            return match[1], posixpath.normpath(match[2])
        beside = file.removeprefix("$(dirname)").lstrip("/") if file.startswith("$(dirname)") else file
        return "", posixpath.normpath(posixpath.join(posixpath.dirname(scope.path), beside))

    def remap(self, scope: _Scope, action: Action) -> None:
        ends = [self.text(scope, action.arguments.get(key)) for key in ("from", "to")]
        if all(isinstance(one, str) for one in ends):
            pair = (str(ends[0]), str(ends[1]))
            scope.remaps = (*scope.remaps, pair)
            self.launched.remaps.setdefault(pair, self.place(scope, action.line))

    def parameter(self, scope: _Scope, action: Action) -> None:
        name = self.text(scope, action.arguments.get("name"))
        if not isinstance(name, Unknown):
            one = self.setting(scope, self.place(scope, action.line), name, action.arguments.get("value"))
            scope.parameters = (*scope.parameters, one)
            self.launched.parameters.append(one)

    def set_environment(self, scope: _Scope, action: Action) -> None:
        name = self.text(scope, action.arguments.get("name"))
        value = self.text(scope, action.arguments.get("value", ""))
        if not isinstance(name, Unknown):
            one = self.variable(self.place(scope, action.line), name, value)
            scope.environment = (*scope.environment, one)
            self.launched.environment.append(one)

    def variable(self, place: Place, name: str, value: str | Unknown) -> Setting:
        if isinstance(value, Unknown):
            self.launched.unknown.setdefault((place, name), value.why)
            return Setting(name, None, place)
        return Setting(name, value, place)

    def later(self, scope: _Scope, action: Action) -> None:
        """What has no counterpart in a spec, such as a process or an event."""
        self.not_read(scope, action.line, str(action.arguments.get("what", "it has no key in a spec")))
        inner = replace(scope.inner(), certain=False, condition="an event of the launch")
        self.actions(inner, action.arguments.get("actions", ()))

    def opaque(self, scope: _Scope, action: Action) -> None:
        self.actions(scope, action.arguments["call"](lambda one: self.text(scope, one)))


def _is_true(value: str | Unknown) -> bool | None:
    text = "" if isinstance(value, Unknown) else value.strip().lower()
    return True if text in _TRUE else False if text in _FALSE else None


def _items(value: Any) -> Sequence[Any]:
    return value if isinstance(value, (list, tuple)) else () if value is None else (value,)


def _pairs(value: Any) -> Iterator[tuple[Any, Any]]:
    if isinstance(value, Mapping):
        yield from value.items()
    elif isinstance(value, (list, tuple)):
        yield from ((one[0], one[1]) for one in value if isinstance(one, (list, tuple)) and len(one) == 2)
