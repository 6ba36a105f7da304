"""Writes out the selections in the tree of a spec: the lists of hosts and robots have plain names afterwards.

A name that a selection makes has the position of the selection. Groups keep their texts.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from typing import Any

import yaml

from swarmctl.diagnostics import Diagnostic, Edit, Fix, Note, Span
from swarmctl.field_types import NAME
from swarmctl.spec.selection import Selector, selects_nothing
from swarmctl.spec.selection_candidates import Candidates, IslandFacts, ProgramFacts, RobotFacts
from swarmctl.yamltext.compose import TEXT, like, pairs_of, part_of, span_of
from swarmctl.yamltext.files import MAX_FINDINGS, MAX_NODES
from swarmctl.yamltext.selection_text import SelectionError, is_selection

GROUPS = "groups"
# The lists of hosts or robots, by section and key.
LISTS = {
    ("links", "hosts"): "hosts",
    ("islands", "hosts"): "hosts",
    ("programs", "hosts"): "hosts",
    ("programs", "robots"): "robots",
    ("control", "of"): "robots",
    ("experiments", "robots"): "robots",
}


def selections(root: yaml.Node | None) -> Iterator[yaml.ScalarNode]:
    """Yields every item of a list of hosts or robots that is more than a name or a range of names."""
    lists = [below(entry, key) for section, key in LISTS for entry in entries(below(root, section)).values()]
    for found in (*lists, *entries(below(root, GROUPS)).values()):
        yield from (item for item in items(found) if is_selection(item.value))


def has_selections(root: yaml.Node | None) -> bool:
    """True for a tree with selections, groups, or programs for several hosts or robots."""
    programs = entries(below(root, "programs")).values()
    lists = (below(program, key) for section, key in LISTS if section == "programs" for program in programs)
    return bool(entries(below(root, GROUPS))) or any(lists) or any(selections(root))


def candidates_in(root: yaml.Node | None) -> Candidates:
    """Returns what the selections of a tree can name."""
    mode = _text(root, "mode") or ""
    leader = _text(root, "leader") if mode == "single-minded" else None  # drives every robot
    return Candidates(
        hosts={name: _texts(below(host, "labels")) for name, host in entries(below(root, "hosts")).items()},
        robots={
            name: RobotFacts(
                _text(robot, "type") or "", leader or _text(robot, "host"), _texts(below(robot, "labels"))
            )
            for name, robot in entries(below(root, "robots")).items()
        },
        programs={
            name: ProgramFacts(_text(program, "host"), _text(program, "robot"))
            for name, program in entries(below(root, "programs")).items()
        },
        islands={
            name: IslandFacts(_text(island, "mode") or "", _texts(below(island, "hosts")))
            for name, island in entries(below(root, "islands")).items()
        },
        groups={name: _texts(group) for name, group in entries(below(root, GROUPS)).items()},
        mode=mode,
    )


def below(node: yaml.Node | None, key: str) -> yaml.Node | None:
    """Returns the value of a key; None without it."""
    if isinstance(node, yaml.MappingNode):
        for one, value in node.value:
            if isinstance(one, yaml.ScalarNode) and one.value == key:
                return value  # type: ignore[no-any-return]
    return None


def entries(node: yaml.Node | None) -> Mapping[str, yaml.Node]:
    """Returns the entries of a section by name, or by number; none of anything else."""
    if isinstance(node, yaml.MappingNode):
        return {key: value for key, (_, value) in reversed(pairs_of(node).items())}
    if isinstance(node, yaml.SequenceNode):
        return {str(number): value for number, value in enumerate(node.value)}
    return {}


def items(node: yaml.Node | None) -> list[yaml.ScalarNode]:
    """Returns the texts in a list."""
    found = node.value if isinstance(node, yaml.SequenceNode) else ()
    return [one for one in found if isinstance(one, yaml.ScalarNode)]


def _text(node: yaml.Node | None, key: str) -> str | None:
    found = below(node, key)
    return found.value if isinstance(found, yaml.ScalarNode) else None


def _texts(node: yaml.Node | None) -> tuple[str, ...]:
    return tuple(one.value for one in items(node))


_PLAIN = re.compile("[A-Za-z0-9][A-Za-z0-9_./:-]*", re.ASCII)  # needs no quotes
_ONE: dict[str, str] = {"hosts": "host", "robots": "robot"}


def expand(root: yaml.Node) -> tuple[yaml.Node, list[Diagnostic]]:
    """Returns the tree with its selections written out, and their errors; the same tree without any."""
    if not has_selections(root):  # most specs; saves reading all names
        return root, []
    programs = _Writer(root)
    root = programs.with_programs()  # selections may name what they make
    writer = _Writer(root, programs)
    writer.check_groups()
    return writer.with_lists(), writer.diagnostics


class _Writer:
    def __init__(self, root: yaml.Node, before: _Writer | None = None) -> None:
        self.root = root
        self.diagnostics: list[Diagnostic] = before.diagnostics if before else []
        self._left: int = before._left if before else MAX_NODES
        self._candidates = candidates_in(root)
        self._selectors: dict[str, Selector] = {
            "hosts": Selector(self._candidates, "hosts"),
            "robots": Selector(self._candidates, "robots"),
        }
        self._circles: dict[frozenset[str], tuple[yaml.Mark, yaml.Mark]] = {}
        self._reported: set[Span] = {one.span for one in self.diagnostics if one.span}

    # Groups

    def check_groups(self) -> None:
        """Reports groups that are wrong, and those that mean nothing."""
        for name, group in entries(below(self.root, GROUPS)).items():
            self._check_group(name, group)

    def _check_group(self, name: str, group: yaml.Node) -> None:
        try:
            if not any(one.members(name) for one in self._selectors.values()):
                message = f"the group `{name}` has no host and no robot"
                self._report_at(group, "SEL002", message, "correct it, or remove the group")
        except SelectionError as error:
            self._report(error, items(group))

    # Lists

    def with_lists(self) -> yaml.Node:
        """Returns the tree with the lists of hosts and robots written out."""
        root = self.root
        for (section, key), kind in LISTS.items():
            made = below(root, section)
            if section != "programs" and made is not None:
                root = _with(root, section, self._section(made, key, kind))
        return root

    def _section(self, node: yaml.Node, key: str, kind: str) -> yaml.Node:
        made = [self._entry(entry, key, kind) for entry in _values(node)]
        if all(new is given for new, given in zip(made, _values(node), strict=True)):
            return node
        if isinstance(node, yaml.MappingNode):
            return like(node, [(name, new) for (name, _), new in zip(node.value, made, strict=True)])
        return like(node, made)

    def _entry(self, entry: yaml.Node, key: str, kind: str) -> yaml.Node:
        found = below(entry, key)
        if isinstance(found, yaml.SequenceNode) and any(is_selection(one.value) for one in items(found)):
            return _with(entry, key, like(found, self._names(found, kind)))
        return entry

    def _names(self, node: yaml.SequenceNode, kind: str) -> list[yaml.Node]:
        """The items of a list, with its selections written out from left to right.

        What is wrong stays at the position of its finding, so that nothing else is reported about it.
        """
        selector = self._selectors[kind]
        selector.idle = {}
        found: list[yaml.Node] = []
        for number, item in enumerate(node.value):
            if not isinstance(item, yaml.ScalarNode) or not is_selection(item.value):
                found.append(item)
                continue
            before = frozenset(one.value for one in found if isinstance(one, yaml.ScalarNode))
            try:
                after = selector.step(item.value, before if number else None, number)
            except SelectionError as error:
                found.append(self._report(error, node.value, item))
                continue
            found = [one for one in found if not isinstance(one, yaml.ScalarNode) or one.value in after]
            new = after - before
            if not self._count(len(new), item):
                return found
            found += [_scalar(item, name) for name in selector.candidates.of(selector.kind) if name in new]
        if not found and (given := items(node)):
            texts = [one.value for one in given]
            nothing = selects_nothing(self._candidates, selector.kind, texts, selector.idle)
            return [self._report(nothing, given, given[-1])]
        return found

    # Programs

    def with_programs(self) -> yaml.Node:
        """Returns the tree in which programs for several hosts or robots are one program for each."""
        programs = below(self.root, "programs")
        if not isinstance(programs, yaml.MappingNode):
            return self.root
        taken = {key.value: key for key, _ in programs.value if isinstance(key, yaml.ScalarNode)}
        pairs: list[Any] = []
        for key, program in programs.value:
            made = self._instances(key, program)
            pairs += [one for one in made if self._is_free(one[0], taken)] if made else [(key, program)]
        written = {id(key) for key, _ in programs.value}
        if len(pairs) == len(written) and all(id(key) in written for key, _ in pairs):
            return self.root
        return _with(self.root, "programs", like(programs, pairs))

    def _is_free(self, key: yaml.ScalarNode, taken: dict[str, yaml.ScalarNode]) -> bool:
        """Notes the name of a program that a list makes; reports one that is there already."""
        other = taken.setdefault(key.value, key)
        if other is not key:
            message = f"this makes a program `{key.value}`, which is there already"
            notes = (Note(span_of(other), "the other"),) if span_of(other) != span_of(key) else ()
            help_lines = ("rename one of the two programs",)
            self._add(Diagnostic("SEL004", message, span_of(key), notes=notes, help=help_lines))
        return other is key

    def _instances(self, key: yaml.Node, program: yaml.Node) -> list[Any]:
        """The programs that one entry makes; none for a program of one host."""
        kinds = [kind for kind in _ONE if isinstance(below(program, kind), yaml.SequenceNode)]
        if not kinds or not isinstance(key, yaml.ScalarNode) or not isinstance(program, yaml.MappingNode):
            return []
        others = [one for one in ("host", "robot", "hosts", "robots") if below(program, one) is not None]
        if len(others) > 1:
            message = f"`{others[0]}` and `{others[1]}` of one program"
            self._report_at(key, "SEL004", message, "keep the one that says where it runs")
        listed = below(program, kinds[0])
        assert isinstance(listed, yaml.SequenceNode)
        names = [one for one in self._names(listed, kinds[0]) if isinstance(one, yaml.ScalarNode)]
        wrong = [one for one in names if not re.fullmatch(NAME, one.value, re.ASCII)]  # reported there
        names = [one for one in names if one not in wrong[1:] or not is_selection(one.value)]
        if not self._count(len(names) * _size(program), key):
            return []
        made = []
        for name in names:
            pairs = [
                (_scalar(one, _ONE[kinds[0]]), name) if value is listed else (one, _copy(value))
                for one, value in program.value
                if not (isinstance(one, yaml.ScalarNode) and one.value in others and value is not listed)
            ]
            own = key if name in wrong[:1] else _scalar(key, f"{key.value}-{name.value}")
            made.append((own, like(program, pairs)))
        return made

    # Errors

    def _count(self, count: int, node: yaml.Node) -> bool:
        if 0 <= self._left < count:
            message = f"selections make more than {MAX_NODES} values here"
            self._report_at(node, "RANGE003", message, "select fewer")
        self._left -= count
        return self._left >= 0

    def _report(
        self, error: SelectionError, nodes: Sequence[yaml.Node], item: yaml.Node | None = None
    ) -> yaml.Node:
        """Reports an error at the selection that has it, which may be in a group.

        Returns ``item`` with the position of the finding.
        """
        if error.inside.startswith("@"):
            nodes = items(below(below(self.root, GROUPS), error.inside.removeprefix("@")))
        elif error.inside:
            island = below(below(self.root, "islands"), error.inside.removeprefix("island:"))
            nodes = items(below(island, "hosts"))
        start, end = part_of(nodes[error.number], error.start, error.end)
        circle = self._circles.setdefault(error.steps, (start, end)) if error.steps else (start, end)
        made = yaml.ScalarNode(TEXT, item.value if item is not None else "", *circle)
        if circle == (start, end):  # each of its groups would be an error
            fix = _guessed(error, nodes[error.number], span_of(made))
            self._add(Diagnostic(error.code, error.message, span_of(made), help=error.help_lines, fix=fix))
        return made

    def _report_at(self, node: yaml.Node, code: str, message: str, *help_lines: str) -> None:
        self._add(Diagnostic(code, message, span_of(node), help=help_lines))

    def _add(self, found: Diagnostic) -> None:
        if found.span not in self._reported and len(self.diagnostics) < MAX_FINDINGS:
            self.diagnostics.append(found)
            self._reported |= {found.span} if found.span else set()


def _guessed(error: SelectionError, node: yaml.Node, place: Span) -> Fix | None:
    """The guess at what a word of a selection should be, where it is written as it is read."""
    style = node.style if isinstance(node, yaml.ScalarNode) else None
    plain = style not in ("'", '"')
    if not error.meant or part_of(node, error.start, error.end)[0] is node.start_mark or style in ("|", ">"):
        return None
    if plain and not _PLAIN.fullmatch(error.meant):  # YAML reads `@lab` and `!k3` only in quotes
        return None
    return Fix(f"write `{error.meant}`", (Edit(place, error.meant),), safe=False)


def _values(node: yaml.Node) -> list[yaml.Node]:
    """What the entries of a mapping or a list are."""
    if isinstance(node, yaml.MappingNode):
        return [value for _, value in node.value]
    return list(node.value) if isinstance(node, yaml.SequenceNode) else []


def _with(node: yaml.Node, key: str, value: yaml.Node) -> yaml.Node:
    """A mapping with another value of one key; the same if that is the same."""
    if below(node, key) is value:
        return node
    old = below(node, key)
    return like(node, [(one, value if given is old else given) for one, given in node.value])


def _scalar(node: Any, text: str) -> yaml.ScalarNode:
    """A text in the place of a node: of a variable too."""
    made: yaml.ScalarNode = copy(node)
    made.tag, made.value = TEXT, text
    return made


def _copy(node: yaml.Node) -> yaml.Node:
    """A copy of lists and mappings, which would otherwise count as aliases."""
    if isinstance(node, yaml.MappingNode):
        return like(node, [(key, _copy(value)) for key, value in node.value])
    return like(node, [_copy(item) for item in node.value]) if isinstance(node, yaml.SequenceNode) else node


def _size(node: Any) -> int:
    if isinstance(node, yaml.ScalarNode):
        return 1
    parts = (one for pair in node.value for one in (pair if isinstance(pair, tuple) else (pair,)))
    return 1 + sum(map(_size, parts))
