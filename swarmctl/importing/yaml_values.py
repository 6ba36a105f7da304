"""The values of a YAML file of a lab: those that its reader takes, and a line for each other one."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import yaml

from swarmctl.importing.draft import Value
from swarmctl.importing.unknown_values import is_secret
from swarmctl.ros_packages.launch_files import Place
from swarmctl.yamltext.compose import is_null, pairs_of

Keys = tuple[str, ...]
"""The way to a value: the keys above it, and its own."""


class YamlValues:
    """The values of one file. What a reader takes is in the draft, or the reader lists it as not read."""

    def __init__(self, path: str, root: yaml.Node | None) -> None:
        self.path, self.root = path, root
        self._taken: set[yaml.Node] = set()  # keys, entries of lists, and whole mappings and lists

    def place(self, node: yaml.Node) -> Place:
        """Returns the line on which a node begins."""
        return Place(self.path, node.start_mark.line + 1)

    def find(self, node: yaml.Node | None, key: str) -> Value | None:
        """Returns the scalar of a mapping at ``key``; None if there is none, or no value."""
        at, value = pairs_of(node).get(key, (None, None))
        if at is None or not isinstance(value, yaml.ScalarNode) or is_empty(value):
            return None
        return Value(value.value, self.place(at))

    def take(self, node: yaml.Node | None, key: str) -> Value | None:
        """Returns what ``find`` does, and takes it."""
        found = self.find(node, key)
        if found is not None:
            self._taken.add(pairs_of(node)[key][0])
        return found

    def take_whole(self, node: yaml.Node) -> None:
        """Takes a node with all that is in it."""
        self._taken.add(node)

    def left(self, is_whole: Callable[[Keys], bool], why: Callable[[Keys], str]) -> Iterator[str]:
        """Yields a line for each value that is not taken, and one for a part of the file that ``is_whole``.

        ``why`` returns the reason; a spec has no key for a value for which it is empty.
        """
        for place, keys in self._left(self.root, (), is_whole, set()):
            name, reason = ".".join(keys), why(keys)
            yield f"{place}: {name}: {reason}" if reason else f"{place}: a spec has no key for {name}"

    def _left(
        self, node: yaml.Node | None, above: Keys, is_whole: Callable[[Keys], bool], seen: set[yaml.Node]
    ) -> Iterator[tuple[Place, Keys]]:
        """What is not taken below a node. A node that aliases repeat is entered once."""
        for at, name, value in _entries(node):
            if is_empty(value) or at in self._taken or value in self._taken:
                continue
            keys = (*above, name) if name else above
            if isinstance(value, yaml.ScalarNode) or value in seen or is_whole(keys):
                yield self.place(at), keys
            else:
                seen.add(value)
                yield from self._left(value, keys, is_whole, seen)


def child_of(node: yaml.Node | None, key: str) -> yaml.Node | None:
    """Returns what a mapping has at ``key``; None if it has nothing there, or is none."""
    return pairs_of(node).get(key, (None, None))[1]


def quoted(text: str) -> str:
    """Returns a text of a file as a message shows it."""
    return "what may be a secret" if is_secret("", text) else f"`{text}`"


def _entries(node: yaml.Node | None) -> Iterator[tuple[yaml.Node, str, yaml.Node]]:
    """The entries of a mapping or a list: where each stands, its key, and its value."""
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            yield key, key.value if isinstance(key, yaml.ScalarNode) else "?", value
    elif isinstance(node, yaml.SequenceNode):
        for item in node.value:
            yield item, "", item


def is_empty(node: yaml.Node) -> bool:
    """Returns True for a key without a value, and for a text, a list or a mapping with nothing in it."""
    return is_null(node) or not node.value
