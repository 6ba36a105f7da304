"""Evaluates a launch file as roslaunch does, with the includes whose packages are found.

What depends on the host, or on Python, is unknown, and nothing is reported about it.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from enum import Enum
from types import MappingProxyType

from swarmctl.ros_packages.package import Package
from swarmctl.ros_packages.xml_tags import Tag, TooLargeError, XmlError, root_of


@dataclass(frozen=True, order=True)
class Place:
    """A line of a file of a package. ``file`` is the path that messages show."""

    file: str
    line: int

    def __str__(self) -> str:
        return f"{self.file}:{self.line}" if self.line else self.file


class Refusal(str, Enum):
    """Why roslaunch stops, or skips a part of the file."""

    UNUSED = "an argument that is given and not declared"
    MISSING = "an argument that has no value"
    FIXED = "an argument that is given, and that the file sets itself"
    BROKEN = "a file that roslaunch cannot read"
    SKIPPED = "an element that roslaunch does not know, and skips"
    ABSENT = "a file of a package that does not exist"


@dataclass(frozen=True)
class Fault:
    """One refusal. ``subject`` is the argument or the path, ``known`` are those that exist."""

    kind: Refusal
    subject: str
    place: Place
    text: str = ""
    known: tuple[str, ...] = ()


@dataclass(frozen=True)
class Setting:
    """A parameter or an environment variable; None for a value that only the host knows."""

    name: str
    value: str | None
    place: Place
    type: str = ""  # that a parameter declares


@dataclass(frozen=True)
class Rosparam:
    """A <rosparam>: ``name`` is empty if its text has the names; None for what only the host knows."""

    name: str | None
    text: str | None
    place: Place


@dataclass(frozen=True)
class Node:
    """A node that a launch file starts; None for a name that only the host knows."""

    name: str | None  # with its namespace
    package: str | None  # empty for a command that is no node, whose program ``executable`` is
    executable: str | None
    remaps: tuple[tuple[str, str], ...]
    place: Place
    certain: bool  # False below an `if` whose value only the host knows
    machine: str | None = ""
    arguments: str | None = ""
    parameters: tuple[Setting, ...] = ()  # its private ones
    environment: tuple[Setting, ...] = ()
    rosparams: tuple[Rosparam, ...] = ()
    has_name: bool = True  # False where the node itself knows it, and ``name`` has its executable
    last: str | None = None  # its name without the namespace, where only the host knows this
    is_component: bool = False  # ``executable`` is its plugin
    is_whole: bool = True  # False where `...` in ``arguments`` stands for what only the host knows


@dataclass(frozen=True)
class Machine:
    """A computer on which roslaunch starts nodes over SSH; None for a value that only the host knows."""

    name: str | None
    address: str | None
    user: str | None
    port: str | None
    place: Place
    is_default: bool  # for nodes that name no machine
    has_password: bool
    certain: bool  # as of a node


@dataclass(frozen=True)
class Include:
    """An include of a file that is not here; None for a namespace or a value that only the host knows."""

    package: str  # empty for a file beside the one that includes it
    file: str  # its path within the package
    namespace: str | None
    arguments: Mapping[str, str | None]
    place: Place
    certain: bool
    environment: tuple[Setting, ...] = ()


@dataclass
class Launched:
    """All that one launch file and its includes bring."""

    arguments: dict[str, str | None] = field(default_factory=dict)  # that the file itself declares
    nodes: list[Node] = field(default_factory=list)
    parameters: list[Setting] = field(default_factory=list)
    environment: list[Setting] = field(default_factory=list)
    rosparams: list[Rosparam] = field(default_factory=list)
    machines: list[Machine] = field(default_factory=list)
    masters: list[Place] = field(default_factory=list)
    packages: dict[str, Place] = field(default_factory=dict)  # that it names, with the first place
    files: dict[str, None] = field(default_factory=dict)  # it and its includes, as messages show them
    unfound: list[Place] = field(default_factory=list)  # includes whose file is not known here
    includes: list[Include] = field(default_factory=list)  # of files that are not here
    left_out: list[tuple[Place, str]] = field(default_factory=list)  # what has no counterpart in a spec
    remaps: dict[tuple[str, str], Place] = field(default_factory=dict)  # of all elements, also without a node
    unknown: dict[tuple[Place, str], str] = field(default_factory=dict)
    """The substitution on which an attribute depends; `if` is also `unless`, and that of what is around."""
    sections: dict[tuple[str, str], bool] = field(default_factory=dict)
    """The nodes of each parameter file of ROS 2 that was read, and whether one of them is here."""
    faults: list[Fault] = field(default_factory=list)
    cost: int = 0

    def add(self, other: Launched) -> None:
        """Adds what another launch file brings."""
        for one in fields(self):
            mine, others = getattr(self, one.name), getattr(other, one.name)
            if isinstance(mine, list):
                mine += others
            elif isinstance(mine, dict):
                mine.update({key: mine.get(key) or value for key, value in others.items()})
        self.cost += other.cost


_ARGUMENT = re.compile(r"\$\(([^()$]{0,200})\)")
#: What roslaunch replaces by the folder of a package.
FIND = re.compile(r"\$\(find [A-Za-z0-9_-]+\)", re.ASCII)
_USED = re.compile(r"\$\(arg\s+([^()$\s]+)\s*\)|\barg\('([^']+)'\)")
_LATER = {"env", "optenv", "anon"}  # known on the host only
_COMMANDS = ("find", "env", "optenv", "dirname", "anon", "arg")
_OF_NODES = {
    "respawn": "has no key in a spec: systemd restarts programs",
    "respawn_delay": "has no key in a spec",
    "required": "has no key in a spec: the other programs run on",
    "launch-prefix": "has no key in a spec; write `command`",
    "cwd": "has no key in a spec",
    "clear_params": "has no key in a spec",
}  # attributes of nodes without a counterpart
_WORDS = {"true": True, "1": True, "false": False, "0": False}

Arguments = Mapping[str, str | None]  # None: declared, with a value that is not known here


class SubstitutionError(ValueError):
    """What roslaunch refuses. ``argument`` is the name of the argument that has no value."""

    def __init__(self, message: str, argument: str = "") -> None:
        super().__init__(message)
        self.argument = argument


def substituted(text: str, arguments: Arguments, dirname: str = "") -> str | None:
    """Returns ``text`` with the values of its arguments; None if the result is not known here.

    `$(find PACKAGE)` remains as it is, since only the host knows the path. Raises `SubstitutionError`.
    """
    if "$(" not in text:
        return text
    if text.startswith("$(eval ") and text.endswith(")"):
        return None
    certain, parts, end = True, list[str](), 0
    for match in _ARGUMENT.finditer(text):
        command, *rest = match[1].split() or [""]
        if command not in _COMMANDS:
            raise SubstitutionError(f"`$({command} ...)` is not a substitution of roslaunch")
        value = _value(command, rest, arguments, dirname) if command not in _LATER else None
        certain = certain and value is not None
        parts += [text[end : match.start()], value or ""]
        end = match.end()
    return "".join((*parts, text[end:])) if certain else None


def _value(command: str, rest: list[str], arguments: Arguments, dirname: str) -> str | None:
    if command == "dirname":
        return dirname or None
    if len(rest) != 1:
        raise SubstitutionError(f"`$({command} ...)` has one name")
    if command == "find":
        return f"$(find {rest[0]})"
    if rest[0] not in arguments:
        raise SubstitutionError(f"the argument `{rest[0]}` has no value", rest[0])
    return arguments[rest[0]]


def unknown_part(text: str, arguments: Arguments, reasons: Mapping[str, str]) -> str:
    """Returns the substitution that keeps ``text`` from being known; ``reasons`` are those of arguments."""
    if text.startswith("$(eval "):
        return "$(eval)"
    for match in _ARGUMENT.finditer(text):
        command, name = [*match[1].split(), "", ""][:2]
        if command == "arg" and arguments.get(name) is None:
            return reasons.get(name, match[0])
        if command in _LATER:
            return f"$({command} {name})"
    return "a value that is too long"


def is_true(value: str | None) -> bool | None:
    """Returns the meaning of an `if` or `unless`; None if it is not known. Raises `SubstitutionError`."""
    if value is None:
        return None
    if value.strip().lower() not in _WORDS:
        raise SubstitutionError("the value of `if` and `unless` is true, false, 1 or 0")
    return _WORDS[value.strip().lower()]


_BYTES = 64  # that take as long to read as one tag to evaluate
_MAX_INCLUDES = 16  # nested
_LONGEST = 500  # characters of a value that is worth a message
_FOUND = re.compile(r"\$\(find ([A-Za-z0-9_-]+)\)/+([^$]+)")
_KEYS: Mapping[str, tuple[str, ...]] = {  # what roslaunch requires of each element
    "arg": ("name",), "node": ("pkg", "type", "name"), "include": ("file",), "param": ("name",),
    "remap": ("from", "to"), "env": ("name", "value"), "machine": ("name", "address"), "group": (),
    "rosparam": (), "test": (), "master": (),
}  # fmt: skip


@dataclass
class _Scope:
    """What holds for a group, an include or a node."""

    package: Package
    path: str  # of the file, within the package
    namespace: str | None
    arguments: dict[str, str | None]
    declared: set[str]
    remaps: tuple[tuple[str, str], ...] = ()
    environment: tuple[Setting, ...] = ()
    certain: bool = True
    condition: str = ""  # the substitution for which it is not certain
    passes_all: bool = False
    chain: tuple[str, ...] = ()
    in_include: dict[str, str | None] | None = None  # what an <include> passes on
    perhaps: set[str] = field(default_factory=set)  # arguments that depend on an unknown condition

    def inner(self) -> _Scope:
        """Returns the scope of an element within: what is declared there ends with it."""
        return replace(self, arguments=dict(self.arguments), declared=set(self.declared))


def evaluate(
    package: Package,
    path: str,
    arguments: Mapping[str, str | None],
    namespace: str,
    packages: Mapping[str, Package],
    *,
    limit: int,
    closed: Mapping[str, str] = MappingProxyType({}),
) -> Launched:
    """Returns what the launch file ``path`` of a package brings, included with ``arguments``.

    An argument is None if its value is not known here. It ends after ``limit`` elements, with those of its
    includes; ``cost`` of the result is their number. Includes of the files ``closed``, each with its package,
    are not read.
    """
    run = _Run(packages, limit, closed)
    scope = _Scope(package, path, namespace, dict(arguments), set())
    run.file(scope, dict(arguments), Place(posixpath.join(package.folder, path), 0))
    run.launched.arguments = {name: scope.arguments.get(name) for name in sorted(scope.declared)}
    run.launched.cost = limit - run.left
    for (file, name), place in run.declared.items():
        if (file, name) not in run.used:
            run.launched.left_out.append((place, f"no node here uses the argument {name}"))
    return run.launched


class _Run:
    def __init__(self, packages: Mapping[str, Package], limit: int, closed: Mapping[str, str]) -> None:
        self.packages, self.closed = packages, closed
        self.launched = Launched()
        self.left = limit
        self.has_output = False  # an attribute of a node
        self.declared: dict[tuple[str, str], Place] = {}  # arguments by file and name
        self.used: set[tuple[str, str]] = set()
        self.reasons: dict[str, str] = {}  # the substitutions on which arguments depend
        self.elements: Mapping[str, Callable[[_Scope, Tag], None]] = {
            "arg": self.argument,
            "group": self.group,
            "node": self.node,
            "include": self.include,
            "param": self.parameter,
            "remap": self.remap,
            "env": self.environment,
            "machine": self.machine,
            "master": self.master,
            "rosparam": self.rosparam,
        }

    def fault(self, scope: _Scope, tag: Tag, kind: Refusal, subject: str, text: str = "") -> None:
        if scope.certain:
            self.launched.faults.append(Fault(kind, subject, self.place(scope, tag), text))

    def left_out(self, scope: _Scope, tag: Tag, why: str) -> None:
        self.launched.left_out.append((self.place(scope, tag), why))

    @staticmethod
    def place(scope: _Scope, tag: Tag) -> Place:
        return Place(posixpath.join(scope.package.folder, scope.path), tag.line)

    def file(self, scope: _Scope, given: Mapping[str, str | None], at: Place) -> None:
        """Evaluates a file, and what was given to it and is not declared."""
        shown = posixpath.join(scope.package.folder, scope.path)
        content = scope.package.contents.get(scope.path)
        self.left -= len(content or b"") // _BYTES
        if content is None or self.left <= 0:
            return
        try:
            found = list(root_of(content).all("launch"))
        except TooLargeError:
            return
        except XmlError as error:
            self.broken(scope, Place(shown, error.line), str(error))
            return
        self.launched.files[shown] = None
        if len(found) != 1:
            self.broken(scope, Place(shown, 1), "it has no element <launch>, or several")
            return
        self.children(scope, found[0])
        known = tuple(sorted(scope.declared))
        for name in given if not scope.passes_all and scope.certain and self.left > 0 else ():
            if name not in scope.declared:
                text = f"`{shown}` does not declare it"
                self.launched.faults.append(Fault(Refusal.UNUSED, name, at, text, known))

    def broken(self, scope: _Scope, place: Place, text: str) -> None:
        if scope.certain:
            self.launched.faults.append(Fault(Refusal.BROKEN, place.file, place, text))

    def children(self, scope: _Scope, tag: Tag) -> None:
        for child in tag.children:
            self.left -= 1
            if self.left <= 0:
                return
            self.child(scope, child)

    def child(self, scope: _Scope, tag: Tag) -> None:
        if tag.name not in _KEYS:
            self.fault(
                scope, tag, Refusal.SKIPPED, tag.name, f"roslaunch skips the unknown element <{tag.name}>"
            )
            return
        try:
            applies = self.applies(scope, tag)
            missing = [key for key in _KEYS[tag.name] if key not in tag.attributes]
            if applies is False:
                self.left_out(scope, tag, "it is not started: its condition is not true")
            if applies is not False and missing:
                self.fault(scope, tag, Refusal.BROKEN, tag.name, f"<{tag.name}> has no `{missing[0]}`")
            elif applies is not False and tag.name not in self.elements:
                self.left_out(scope, tag, f"a <{tag.name}> has no counterpart in a spec")
            elif applies is not False:
                inner = scope if applies else self.unsure(scope, tag)
                if inner.condition and tag.name not in {"arg", "group", "include"}:
                    self.launched.unknown.setdefault((self.place(scope, tag), "if"), inner.condition)
                self.elements[tag.name](inner, tag)
                scope.remaps = inner.remaps if applies else scope.remaps
        except SubstitutionError as error:
            if error.argument:
                self.missing(scope, tag, error.argument)
                scope.arguments[error.argument] = None  # one finding for each argument
            else:
                self.fault(scope, tag, Refusal.BROKEN, tag.name, str(error))

    def missing(self, scope: _Scope, tag: Tag, name: str) -> None:
        if name not in scope.declared:
            self.fault(
                scope, tag, Refusal.BROKEN, name, f"it uses the argument `{name}` and does not declare it"
            )
        elif scope.chain:
            text = f"it needs the argument `{name}`, and what includes it does not pass it"
            self.fault(scope, tag, Refusal.BROKEN, name, text)
        else:
            self.fault(scope, tag, Refusal.MISSING, name)

    def applies(self, scope: _Scope, tag: Tag) -> bool | None:
        for key, wanted in (("if", True), ("unless", False)):
            if key in tag.attributes:
                value = is_true(self.value(scope, tag, key))
                return None if value is None else value is wanted
        return True

    def unsure(self, scope: _Scope, tag: Tag) -> _Scope:
        """The scope of an element whose condition is not known."""
        key = "if" if "if" in tag.attributes else "unless"
        return replace(scope, certain=False, condition=scope.condition or self.reason(scope, tag, key))

    def reason(self, scope: _Scope, tag: Tag, key: str) -> str:
        return unknown_part(tag.attributes[key], scope.arguments, self.reasons)

    def optional(self, scope: _Scope, tag: Tag, key: str) -> str | None:
        """The value of an attribute; empty if it is left out."""
        return self.value(scope, tag, key) if key in tag.attributes else ""

    def value(self, scope: _Scope, tag: Tag, key: str) -> str | None:
        folder = posixpath.join(f"$(find {scope.package.name})", posixpath.dirname(scope.path))
        found = substituted(tag.attributes[key], scope.arguments, folder)
        self.used |= {(scope.path, one[1] or one[2]) for one in _USED.finditer(tag.attributes[key])}
        for match in _FOUND.finditer(found or tag.attributes[key]) if scope.certain else ():
            self.launched.packages.setdefault(match[1], self.place(scope, tag))
        found = found if found is None or len(found) <= _LONGEST else None
        if found is None and tag.name != "arg" and key not in {"if", "unless"}:
            reason = self.reason(scope, tag, key)
            self.launched.unknown.setdefault((self.place(scope, tag), key), reason)
        return found

    def argument(self, scope: _Scope, tag: Tag) -> None:
        name = self.value(scope, tag, "name")
        if name is None:
            return
        into = scope.arguments if scope.in_include is None else scope.in_include
        if scope.in_include is None:
            self.declared.setdefault((scope.path, name), self.place(scope, tag))
        if not scope.certain:
            scope.declared.add(name)
            scope.perhaps.add(name)
            self.reasons[name] = scope.condition
            into.setdefault(name, None)
            self.left_out(scope, tag, f"whether the argument {name} is set depends on {scope.condition}")
            return
        if name in scope.declared and not scope.passes_all:
            self.fault(scope, tag, Refusal.BROKEN, name, f"the argument `{name}` is declared twice")
        scope.declared.add(name)
        if "value" in tag.attributes:
            if name in into and scope.in_include is None and not scope.passes_all:
                self.fault(scope, tag, Refusal.FIXED, name, f"the file sets `{name}` itself, by `value`")
            self.reasons[name] = self.reason(scope, tag, "value")
            into[name] = self.value(scope, tag, "value")
        elif "default" in tag.attributes:
            value = self.value(scope, tag, "default")
            if name not in into:
                self.reasons[name] = self.reason(scope, tag, "default")
            into.setdefault(name, value)
        elif scope.in_include is not None:
            self.left_out(scope, tag, f"the argument {name} has no value here")

    def group(self, scope: _Scope, tag: Tag) -> None:
        inner = scope.inner()
        inner.namespace = self.namespace(scope, tag)
        self.unkeyed(scope, tag, ("clear_params",))
        started = len(self.launched.nodes) + len(self.launched.includes)
        self.children(inner, tag)
        if tag.attributes and started == len(self.launched.nodes) + len(self.launched.includes):
            self.left_out(scope, tag, f"nothing starts in this group ({' '.join(tag.attributes.values())})")

    def unkeyed(self, scope: _Scope, tag: Tag, keys: Iterable[str]) -> None:
        """Lists attributes that have no counterpart in a spec."""
        for key in keys:
            if tag.attributes.get(key, "false") not in ("false", "0"):
                why = _OF_NODES.get(key, "has no key in a spec")
                self.left_out(scope, tag, f'{key}="{tag.attributes[key]}" {why}')

    def namespace(self, scope: _Scope, tag: Tag) -> str | None:
        if "ns" not in tag.attributes:
            return scope.namespace
        return _joined(scope.namespace, self.value(scope, tag, "ns"))

    def node(self, scope: _Scope, tag: Tag) -> None:
        package, kind, name = (self.value(scope, tag, key) for key in ("pkg", "type", "name"))
        inner = scope.inner()
        inner.namespace, inner.condition = self.namespace(scope, tag), ""
        found = self.launched
        first, first_variable, first_file = (
            len(found.parameters),
            len(found.environment),
            len(found.rosparams),
        )
        for child in tag.children:
            if child.name in {"remap", "param", "env", "rosparam"}:
                self.child(inner, child)
        if package is not None and scope.certain:
            found.packages.setdefault(package, self.place(scope, tag))
        self.unkeyed(scope, tag, _OF_NODES)
        if "output" in tag.attributes and not self.has_output:
            self.has_output = True
            why = "the journal of a host has what its programs print"
            self.left_out(scope, tag, f"output of this node and of others: {why}")
        full = _joined(inner.namespace, name)
        if full is None and inner.namespace is None:
            reason = "the namespace around it"
            self.launched.unknown.setdefault((self.place(scope, tag), "namespace"), reason)
        node = Node(
            full, package, kind, inner.remaps, self.place(scope, tag), scope.certain,
            self.optional(scope, tag, "machine"), self.optional(scope, tag, "args"),
            tuple(found.parameters[first:]), (*scope.environment, *found.environment[first_variable:]),
            tuple(found.rosparams[first_file:]), last=name,
        )  # fmt: skip
        found.nodes.append(node)

    def include(self, scope: _Scope, tag: Tag) -> None:
        file = self.value(scope, tag, "file")
        passes_all = "pass_all_args" in tag.attributes and self.value(scope, tag, "pass_all_args") != "false"
        given: dict[str, str | None] = {}
        passing = scope.inner()
        passing.in_include, passing.declared, passing.passes_all = given, set(), passes_all
        passing.perhaps = set()
        for child in tag.children:
            if child.name in {"arg", "env"}:
                self.child(passing, child)
        package, path = self.found(scope, tag, file)
        self.unkeyed(scope, tag, ("clear_params",))
        shown = posixpath.normpath(posixpath.join(package.folder, path)) if package else ""
        if package is None or shown in self.closed or len(scope.chain) >= _MAX_INCLUDES:
            match = _FOUND.fullmatch(file or "")
            self.launched.files |= {shown: None} if shown in self.closed else {}
            if match is None or (match[1] in self.packages and shown not in self.closed):
                self.launched.unfound.append(self.place(scope, tag))
            else:
                place, namespace = self.place(scope, tag), self.namespace(scope, tag)
                if scope.condition:
                    self.launched.unknown.setdefault((place, "if"), scope.condition)
                self.around(scope, tag)
                if namespace is None:
                    self.launched.unknown.setdefault((place, "namespace"), "the namespace around it")
                one = Include(
                    match[1], posixpath.normpath(match[2]), namespace, given, place, scope.certain,
                    passing.environment,
                )  # fmt: skip
                self.launched.includes.append(one)
            return
        inner = _Scope(
            package, path, self.namespace(scope, tag), {**(scope.arguments if passes_all else {}), **given},
            set(), scope.remaps, passing.environment, scope.certain, scope.condition, passes_all,
            (*scope.chain, path),
        )  # fmt: skip
        certain = {name: value for name, value in given.items() if name not in passing.perhaps}
        self.file(inner, certain, self.place(scope, tag))

    def around(self, scope: _Scope, tag: Tag) -> None:
        """Lists the remaps around an include whose file is not here."""
        for old, new in scope.remaps:
            self.left_out(scope, tag, f"it has no remap from {old} to {new}; write it in its launch file")

    def found(self, scope: _Scope, tag: Tag, file: str | None) -> tuple[Package | None, str]:
        """The package and the path in it; reports a file that a found package does not have."""
        match = _FOUND.fullmatch(file or "")
        if match is None:
            return None, ""
        package, path = self.packages.get(match[1]), posixpath.normpath(match[2])
        if package is None:
            return None, ""
        if path not in package.files:
            text = f"package `{package.name}` has no file `{path}`"
            if scope.certain:
                place, known = self.place(scope, tag), tuple(sorted(package.files))
                self.launched.faults.append(Fault(Refusal.ABSENT, path, place, text, known))
            return None, ""
        return package, path

    def parameter(self, scope: _Scope, tag: Tag) -> None:
        name = self.value(scope, tag, "name")
        value = self.value(scope, tag, "value") if "value" in tag.attributes else None
        if name is not None and not scope.condition:
            kind = self.optional(scope, tag, "type") or ""
            self.launched.parameters.append(Setting(name, value, self.place(scope, tag), kind))
        self.unkeyed(scope, tag, ("textfile", "binfile", "command"))
        if "textfile" in tag.attributes:
            self.found(scope, tag, self.value(scope, tag, "textfile"))

    def rosparam(self, scope: _Scope, tag: Tag) -> None:
        name = _joined(self.optional(scope, tag, "ns"), self.optional(scope, tag, "param"))
        text = self.rosparam_text(scope, tag)
        found = Rosparam(name, None if scope.condition else text, self.place(scope, tag))
        self.launched.rosparams.append(found)

    def rosparam_text(self, scope: _Scope, tag: Tag) -> str | None:
        if tag.attributes.get("command", "load") != "load":
            return None
        if "file" in tag.attributes:
            package, path = self.found(scope, tag, self.value(scope, tag, "file"))
            content = package.contents.get(path) if package else None
            return None if content is None else content.decode("utf-8", "replace")
        if tag.attributes.get("subst_value", "").lower() in {"true", "1"}:
            return substituted(tag.text, scope.arguments)
        return tag.text

    def remap(self, scope: _Scope, tag: Tag) -> None:
        old, new = self.value(scope, tag, "from"), self.value(scope, tag, "to")
        if old is not None and new is not None:
            scope.remaps = (*scope.remaps, (old, new))
            self.launched.remaps.setdefault((old, new), self.place(scope, tag))

    def environment(self, scope: _Scope, tag: Tag) -> None:
        name, value = self.value(scope, tag, "name"), self.value(scope, tag, "value")
        if name is not None and not scope.condition:
            one = Setting(name, value, self.place(scope, tag))
            self.launched.environment.append(one)
            scope.environment = (*scope.environment, one)

    def machine(self, scope: _Scope, tag: Tag) -> None:
        name, address, user, port, default = (
            self.optional(scope, tag, key) for key in ("name", "address", "user", "ssh-port", "default")
        )
        found = Machine(
            name, address, user, port, self.place(scope, tag),
            is_default=default == "true", has_password="password" in tag.attributes, certain=scope.certain,
        )  # fmt: skip
        self.unkeyed(scope, tag, ("env-loader", "timeout", "ros-root", "ros-package-path", "ros-ip"))
        if default not in ("", "true", "false"):
            self.unkeyed(scope, tag, ("default",))
        self.launched.machines.append(found)

    def master(self, scope: _Scope, tag: Tag) -> None:
        self.launched.masters.append(self.place(scope, tag))
        self.left_out(scope, tag, "a <master> has no counterpart in a spec")


def _joined(namespace: str | None, name: str | None) -> str | None:
    if name is None or name.startswith("/"):
        return name and name.rstrip("/")
    return None if namespace is None else f"{namespace.rstrip('/')}/{name}".rstrip("/")
