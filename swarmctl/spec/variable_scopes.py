"""The variables of a spec: those of its own ``vars``, and of entries of ``hosts``, ``robots``, ``programs``.

At an entry the most special value holds: the program's, the robot's, its host's, then that of the spec, which
may be a mapping with selections of hosts and robots as keys, and ``default``.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import yaml

from swarmctl.diagnostics import Diagnostic, Note, Span, has_errors
from swarmctl.spec import selection_expansion
from swarmctl.spec.selection import Selector, select, selects_nothing
from swarmctl.spec.selection_candidates import Candidates
from swarmctl.spec.selection_expansion import below, candidates_in, entries
from swarmctl.yamltext.compose import like, pairs_of, span_of
from swarmctl.yamltext.selection_text import SelectionError
from swarmctl.yamltext.variables import KEY, Scope, VariableError, Writer, is_small_enough

DEFAULT = "default"
_ENTRIES = ("hosts", "robots", "programs")
_RUNS_ON = ("host", "robot", "hosts", "robots")  # of a program
_MOST_COMPARED = 4_000_000  # names with selections, which takes two seconds


def expand(root: yaml.Node) -> tuple[yaml.Node, list[Diagnostic]]:
    """Returns the tree with its variables replaced and its selections written out, and their errors.

    A program for several hosts or robots gets the values of each.
    """
    if not _has_variables(root):
        return selection_expansion.expand(root)
    variables = _Variables(root)
    root, wrong = selection_expansion.expand(variables.before_selections())
    root = variables.in_programs(root)
    return root, [*variables.diagnostics(), *wrong]


def replaced(root: yaml.Node) -> yaml.Node:
    """Returns the tree with the variables replaced that need no list of programs."""
    return _Variables(root).before_selections() if _has_variables(root) else root


def _has_variables(root: yaml.Node) -> bool:
    """True for a tree that sets variables; others keep what looks like one."""
    if not is_small_enough(root):
        return False
    named = (entry for section in _ENTRIES for entry in entries(below(root, section)).values())
    return any(below(one, KEY) is not None for one in (root, *named))


class _Choice(NamedTuple):
    """One value of a variable that differs, and the robots and hosts that it is for."""

    key: yaml.ScalarNode
    value: yaml.Node
    robots: Collection[str]
    hosts: Collection[str]


@dataclass
class _Choices:
    """The values of a variable by selection."""

    of_robots: dict[str, list[_Choice]] = field(default_factory=dict)
    of_hosts: dict[str, list[_Choice]] = field(default_factory=dict)

    def of(self, robot: str | None, host: str | None) -> Sequence[_Choice]:
        """Returns those that fit best: of a robot's, those that do not mean its host, if any."""
        if robot is None:
            return self.of_hosts.get(host or "", ())
        found = self.of_robots.get(robot, [])
        return [one for one in found if host not in one.hosts] or found


class _Variables:
    """Replaces the variables of one spec: at first as far as names of hosts and robots have them."""

    def __init__(self, root: Any) -> None:
        self._root = root
        self._of_spec = pairs_of(below(root, KEY))
        self._entries = {one: entries(below(root, one)) for one in _ENTRIES}
        self._choices: dict[int, _Choices | VariableError] = {}
        self._left = _MOST_COMPARED
        self._candidates: Candidates | None = None
        self._links: Sequence[yaml.Node] = ()
        self._used: set[str | Span] = set()  # names, and the places of values of entries
        self._writer = Writer()

    def before_selections(self) -> yaml.Node:
        """Returns the tree with its variables replaced; of programs just where they run."""
        named = self._sections()
        self._candidates = candidates_in(named)
        self._links = list(entries(below(named, "links")).values())
        self._writer, self._used = Writer(), set()
        return self._sections()

    def in_programs(self, root: Any) -> yaml.Node:
        """Returns the tree with the other variables of programs replaced."""
        programs: Any = below(root, "programs")
        if not isinstance(programs, yaml.MappingNode):
            return root  # type: ignore[no-any-return]
        made = [(key, self._program(entry)) for key, entry in programs.value]
        kept = ((key, like(programs, made) if one is programs else one) for key, one in root.value)
        return like(root, list(kept))

    def diagnostics(self) -> list[Diagnostic]:
        """Returns what is wrong; without errors also the variables that nothing uses."""
        found = self._writer.diagnostics
        if has_errors(found):
            return found
        unused = [key for name, (key, _) in self._of_spec.items() if name not in self._used]
        for section in self._entries.values():
            for pairs in (pairs_of(below(entry, KEY)) for entry in section.values()):
                unused += [key for key, value in pairs.values() if span_of(value) not in self._used]
        help_ = ("use it, or remove it",)
        return [
            *found,
            *(
                Diagnostic("VAR004", f"nothing uses the variable `{key.value}`", span_of(key), help=help_)
                for key in unused
            ),
        ]

    # Places

    def _sections(self) -> yaml.Node:
        return like(self._root, [(key, self._section(key.value, one)) for key, one in self._root.value])

    def _section(self, name: str, node: Any) -> yaml.Node:
        if name == KEY:
            return node  # type: ignore[no-any-return]
        if name in _ENTRIES and isinstance(node, yaml.MappingNode):
            return like(node, [(key, self._entry(name, str(key.value), one)) for key, one in node.value])
        if name == "links" and isinstance(node, yaml.SequenceNode):
            return like(node, [self._link(number, one) for number, one in enumerate(node.value)])
        return self._writer.replaced(node, self._scope())

    def _entry(self, section: str, name: str, entry: yaml.Node) -> yaml.Node:
        if section == "programs":
            return self._writer.replaced(entry, self._scope(entry), _RUNS_ON.__contains__)
        of_robot = section == "robots"
        scope = self._scope(entry, name if of_robot else None, self._host_of(name) if of_robot else name)
        return self._writer.replaced(entry, scope, _is_no_variable)

    def _link(self, number: int, link: yaml.Node) -> yaml.Node:
        named = self._links[number] if number < len(self._links) else link
        robot = _text(named, "robot")
        scope = self._scope(None, robot, _text(named, "host") or self._host_of(robot))
        return self._writer.replaced(link, scope)

    def _program(self, entry: yaml.Node) -> yaml.Node:
        robot = _text(entry, "robot")
        scope = self._scope(entry, robot, _text(entry, "host") or self._host_of(robot))
        return self._writer.replaced(entry, scope, _is_no_variable)

    def _host_of(self, robot: str | None) -> str | None:
        facts = self._candidates.robots.get(robot or "") if self._candidates else None
        return facts.host if facts else None

    # Values

    def _scope(
        self, entry: yaml.Node | None = None, robot: str | None = None, host: str | None = None
    ) -> Scope:
        around = (entry, self._entries["robots"].get(robot or ""), self._entries["hosts"].get(host or ""))
        layers = [pairs for one in around if one is not None and (pairs := pairs_of(below(one, KEY)))]

        def look(name: str) -> yaml.Node | None:
            for layer in layers:
                if name in layer:
                    self._used.add(span_of(layer[name][1]))
                    return layer[name][1]
            if name not in self._of_spec:
                return None
            self._used.add(name)
            return self._chosen(name, robot, host)

        return Scope(look, lambda: dict.fromkeys(name for one in (*layers, self._of_spec) for name in one))

    def _chosen(self, name: str, robot: str | None, host: str | None) -> yaml.Node:
        """Returns the value of a variable of the spec. Raises ``VariableError``."""
        key, node = self._of_spec[name]
        if not isinstance(node, yaml.MappingNode):
            return node
        found = self._choices_of(node).of(robot, host) if self._candidates else ()
        if len({_written(one.value) for one in found}) > 1:
            notes = [Note(span_of(one.key), "one of them") for one in found[:3]]
            message = f"several values of `{name}` fit `{robot or host}`"
            raise VariableError("VAR005", message, "let one selection fit it", notes=notes)
        if found:
            return found[0].value
        if (default := below(node, DEFAULT)) is not None:
            return default
        where = f"for `{robot or host}`" if robot or host else "here: this is of no robot or host"
        help_ = f"add `{DEFAULT}` to it"
        note = Note(span_of(key), "it is set by selections here")
        raise VariableError("VAR003", f"`{name}` has no value {where}", help_, notes=[note])

    def _choices_of(self, node: yaml.MappingNode) -> _Choices:
        if id(node) not in self._choices:
            try:
                self._choices[id(node)] = self._read(node)
            except VariableError as error:
                self._choices[id(node)] = error
        found = self._choices[id(node)]
        if isinstance(found, VariableError):
            raise found
        return found

    def _read(self, node: yaml.MappingNode) -> _Choices:
        made = _Choices()
        for key, value in node.value:
            if isinstance(key, yaml.ScalarNode) and key.value != DEFAULT:
                one = _Choice(key, value, *self._meant(key))
                for robot in one.robots:
                    made.of_robots.setdefault(robot, []).append(one)
                for host in one.hosts:
                    made.of_hosts.setdefault(host, []).append(one)
        return made

    def _meant(self, key: yaml.ScalarNode) -> tuple[Collection[str], Collection[str]]:
        """Returns the robots and the hosts that a selection means. Raises ``VariableError``."""
        known, text = self._candidates or Candidates(), key.value
        if text in known.hosts_and_robots:  # most keys; a selector of its own for each would take long
            of_host = known.robots_of.get(text, ()) if text in known.hosts else ()
            return {*of_host, *([text] if text in known.robots else [])}, {text} & known.hosts.keys()
        self._left -= len(known.hosts_and_robots)
        if self._left < 0:
            raise VariableError("RANGE003", "this compares too many names", "use fewer selections", at=key)
        try:
            robots = Selector(known, "robots").step(text, None)
            hosts: Collection[str] = ()
            if Selector(known, "hosts").step(text, None):
                selected = select([text], known, "hosts")
                hosts = set(selected.names) - selected.through.keys()
            if not robots and not hosts:
                raise selects_nothing(known, "robots", [text], ())
        except SelectionError as error:
            raise VariableError(error.code, error.message, *error.help_lines, at=key) from None
        return robots, hosts


def _written(node: yaml.Node) -> tuple[object, ...]:
    """What two equal values have in common."""
    items = node.value if isinstance(node, yaml.SequenceNode) else [node]
    return (type(node), *((one.tag, str(one.value)) for one in items if isinstance(one, yaml.Node)))


def _is_no_variable(key: str) -> bool:
    return key != KEY


def _text(node: yaml.Node | None, key: str) -> str | None:
    found = below(node, key)
    return found.value if isinstance(found, yaml.ScalarNode) else None
