"""Overlays: a file laid over a spec says what differs. Trees in, a new tree out; each node keeps its place.

Mappings merge key by key; what else stands in the overlay replaces what it covers; ``~`` takes a key away.
Links and ``control`` merge entry by entry: a network is known by its name, a line by its robot, a commander
by who it is.
"""

from __future__ import annotations

import yaml

from swarmctl.spec.diagnostics import Diagnostic, Note
from swarmctl.spec.limits import MAX_DEPTH, MAX_NODES
from swarmctl.spec.nodes import Pair, is_null, pairs_of, span_of

# By which keys the entries of a list are known, and the key that, taken away, takes the entry with it.
_ENTRIES = {"links": (("robot", "name"), "kind"), "control": (("by",), "of")}


def overlaid(base: yaml.Node, over: yaml.Node) -> tuple[yaml.Node, list[Diagnostic]]:
    """``base`` with what ``over`` says laid over it, and what of that makes no sense."""
    overlay = _Overlay()
    if not isinstance(over, yaml.MappingNode):
        wrong = "an overlay has keys of a spec, such as `hosts` or `robots`"
        return base, [Diagnostic("OVER003", wrong, span_of(over), help=("write it like: mode: central",))]
    return overlay.merged(base, over), overlay.diagnostics


class _Overlay:
    """One tree while it is laid over another."""

    def __init__(self) -> None:
        self.diagnostics: list[Diagnostic] = []
        self.left = MAX_NODES  # aliases of aliases may lead along the same pairs again and again

    def merged(self, base: yaml.Node, over: yaml.Node, depth: int = 0) -> yaml.Node:
        if isinstance(base, yaml.MappingNode) and isinstance(over, yaml.MappingNode):
            return self._mapping(base, over, depth) if depth < MAX_DEPTH and self.left > 0 else over
        return over

    def _mapping(self, base: yaml.MappingNode, over: yaml.MappingNode, depth: int) -> yaml.MappingNode:
        old, new = pairs_of(base), pairs_of(over)
        self.left -= len(new)
        laid: list[Pair] = []
        for key, value in base.value:
            name = key.value if isinstance(key, yaml.ScalarNode) else None
            if name not in new or old[name][0] is not key:
                laid.append((key, value))
            elif not is_null(new[name][1]):
                laid.append(self._pair(name, (key, value), new[name], depth))
        for key, value in over.value:
            name = key.value if isinstance(key, yaml.ScalarNode) else None
            if name is None or new[name][0] is not key:
                laid.append(
                    (key, value)
                )  # what is no word, or said twice, is for the builder of data to tell
            elif name not in old and is_null(value):
                self._nothing_there(f"`{name}`", key)
            elif name not in old:
                laid.append((key, value))
        return yaml.MappingNode(base.tag, laid, base.start_mark, base.end_mark, base.flow_style)

    def _pair(self, name: str, old: Pair, new: Pair, depth: int) -> Pair:
        """A key that stands in both. Where the value is the overlay's, so is the key."""
        below, above = old[1], new[1]
        value: yaml.Node
        if isinstance(below, yaml.SequenceNode) and isinstance(above, yaml.SequenceNode):
            known = depth == 0 and name in _ENTRIES
            value = self._entries(below, above, *_ENTRIES[name]) if known else above
        else:
            value = self.merged(below, above, depth + 1)
        return (new[0] if value is above else old[0]), value

    def _entries(
        self, base: yaml.SequenceNode, over: yaml.SequenceNode, names: tuple[str, ...], essence: str
    ) -> yaml.SequenceNode:
        """A list whose entries are known by a name."""
        places: dict[tuple[str, str] | None, list[int]] = {}
        for place, entry in enumerate(base.value):
            places.setdefault(_identity(entry, names), []).append(place)
        laid: dict[int, yaml.Node] = dict(enumerate(base.value))
        added: list[yaml.Node] = []
        said: dict[tuple[str, str], yaml.Node] = {}
        for entry in over.value:
            identity = _identity(entry, names)
            meant = places.get(identity, []) if identity else []
            removed = _says_null(entry, essence)
            if identity and (len(meant) > 1 or identity in said):
                several = [said[identity]] if identity in said else [base.value[place] for place in meant]
                self._ambiguous(identity, entry, several)
            elif removed and not meant:
                self._nothing_there(f"entry `{': '.join(identity)}`" if identity else "such entry", entry)
            elif removed:
                del laid[meant[0]]
            elif meant:
                laid[meant[0]] = self._entry(base.value[meant[0]], entry, essence)
            else:
                added.append(entry)
            if identity:
                said[identity] = entry
        items = [*laid.values(), *added]
        return yaml.SequenceNode(base.tag, items, base.start_mark, base.end_mark, base.flow_style)

    def _entry(self, old: yaml.MappingNode, new: yaml.MappingNode, essence: str) -> yaml.Node:
        """The two as one; a link of another kind has other keys, and takes the place of the old one."""
        was, becomes = pairs_of(old).get(essence), pairs_of(new).get(essence)
        another = (
            was is not None
            and becomes is not None
            and isinstance(becomes[1], yaml.ScalarNode)
            and was[1].value != becomes[1].value
        )
        return new if another else self.merged(old, new, 1)

    def _nothing_there(self, what: str, node: yaml.Node) -> None:
        self.diagnostics.append(
            Diagnostic(
                "OVER001",
                f"the files below have no {what} to take away",
                span_of(node),
                help=("remove this, or write the name as the file below has it",),
            )
        )

    def _ambiguous(self, identity: tuple[str, str], entry: yaml.Node, several: list[yaml.Node]) -> None:
        self.diagnostics.append(
            Diagnostic(
                "OVER002",
                f"several entries have `{': '.join(identity)}`, and this may mean any of them",
                span_of(entry),
                notes=tuple(Note(span_of(one), "one of them") for one in several[:3]),
                help=("say what differs in the file where they stand",),
            )
        )


def _identity(entry: yaml.Node, names: tuple[str, ...]) -> tuple[str, str] | None:
    """By what an entry of a list is known: the first of ``names`` that it has, and its value."""
    if not isinstance(entry, yaml.MappingNode):
        return None
    pairs = pairs_of(entry)
    found = ((name, pairs[name][1]) for name in names if name in pairs)
    return next(((name, node.value) for name, node in found if isinstance(node, yaml.ScalarNode)), None)


def _says_null(entry: yaml.Node, key: str) -> bool:
    pair = pairs_of(entry).get(key) if isinstance(entry, yaml.MappingNode) else None
    return pair is not None and is_null(pair[1])
