"""Overlays: merges a file with differences into a spec. Trees in, a new tree out; nodes keep their positions.

Mappings merge key by key; other values replace; ``~`` removes a key. Links and ``control`` merge entry by
entry: a network is identified by its name, a line by its robot, an entry of ``control`` by its commander.
"""

from __future__ import annotations

import yaml

from swarmctl.diagnostics import Diagnostic, Note
from swarmctl.suggest import did_you_mean
from swarmctl.yamltext.compose import OverlaidNode, Pair, is_null, pairs_of, span_of
from swarmctl.yamltext.files import MAX_DEPTH, MAX_NODES

# Keys that identify the entries of a list, and the key whose removal removes the entry.
_ENTRIES = {"links": (("robot", "name"), "kind"), "control": (("by",), "of")}


def overlaid(base: yaml.Node, over: yaml.Node) -> tuple[yaml.Node, list[Diagnostic]]:
    """Returns ``base`` merged with the overlay ``over``, and the errors of the overlay."""
    overlay = _Overlay()
    if not isinstance(over, yaml.MappingNode):
        wrong = "an overlay has keys of a spec, such as `hosts` or `robots`"
        return base, [Diagnostic("OVER003", wrong, span_of(over), help=("write it like: mode: central",))]
    return overlay.merged(base, over), overlay.diagnostics


class _Overlay:
    """Merges one tree into another."""

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
        removed = dict(base.removed) if isinstance(base, OverlaidNode) else {}
        for key, value in base.value:
            name = key.value if isinstance(key, yaml.ScalarNode) else None
            if name not in new or old[name][0] is not key:
                laid.append((key, value))
            elif is_null(new[name][1]):
                removed[name] = new[name]
            else:
                laid.append(self._pair(name, (key, value), new[name], depth))
        for key, value in over.value:
            name = key.value if isinstance(key, yaml.ScalarNode) else None
            if name is None or new[name][0] is not key:
                laid.append((key, value))  # building the data reports keys that are not text, or duplicate
            elif name not in old and is_null(value):
                self._nothing_there(f"`{name}`", key)
            elif name not in old:
                laid.append((key, value))
        made = OverlaidNode(base.tag, laid, base.start_mark, base.end_mark, base.flow_style)
        made.removed = removed
        return made

    def _pair(self, name: str, old: Pair, new: Pair, depth: int) -> Pair:
        """Merges a key that both have. If the overlay's value replaces, so does its key."""
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
        """Merges a list whose entries are identified by a key."""
        places: dict[tuple[str, str] | None, list[int]] = {}
        for place, entry in enumerate(base.value):
            places.setdefault(_identity(entry, names), []).append(place)
        laid: dict[int, yaml.Node] = dict(enumerate(base.value))
        added: list[yaml.Node] = []
        seen: dict[tuple[str, str], yaml.Node] = {}
        for entry in over.value:
            identity = _identity(entry, names)
            meant = places.get(identity, []) if identity else []
            removed = _has_null(entry, essence)
            if identity and (len(meant) > 1 or identity in seen):
                several = [seen[identity]] if identity in seen else [base.value[place] for place in meant]
                self._ambiguous(identity, entry, several)
            elif removed and not meant:
                self._nothing_there(f"entry `{': '.join(identity)}`" if identity else "such entry", entry)
            elif removed:
                del laid[meant[0]]
            elif meant:
                laid[meant[0]] = self._entry(base.value[meant[0]], entry, essence)
            elif identity and essence not in pairs_of(entry):
                known = [one[1] for one in places if one and one[0] == identity[0]]
                self._no_such_entry(identity, entry, known, essence)
            else:
                added.append(entry)
            if identity:
                seen[identity] = entry
        items = [*laid.values(), *added]
        return yaml.SequenceNode(base.tag, items, base.start_mark, base.end_mark, base.flow_style)

    def _entry(self, old: yaml.MappingNode, new: yaml.MappingNode, essence: str) -> yaml.Node:
        """Merges two entries; a link of another kind has other keys and replaces the old one."""
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
                f"the files below have no {what} to remove",
                span_of(node),
                help=("remove this line, or correct the name",),
            )
        )

    def _no_such_entry(
        self, identity: tuple[str, str], entry: yaml.MappingNode, known: list[str], essence: str
    ) -> None:
        """Without its essence an entry changes one of the base file; none is meant by this one."""
        key, name = identity
        self.diagnostics.append(
            Diagnostic(
                "OVER004",
                f"the files below have no entry `{key}: {name}` to change",
                span_of(pairs_of(entry)[key][1]),
                help=(
                    *did_you_mean(name, known, "the entries are"),
                    f"a new entry needs `{essence}`",
                ),
            )
        )

    def _ambiguous(self, identity: tuple[str, str], entry: yaml.Node, several: list[yaml.Node]) -> None:
        self.diagnostics.append(
            Diagnostic(
                "OVER002",
                f"several entries have `{': '.join(identity)}`; which one is changed is ambiguous",
                span_of(entry),
                notes=tuple(Note(span_of(one), "one of them") for one in several[:3]),
                help=("change them in the file that has them",),
            )
        )


def _identity(entry: yaml.Node, names: tuple[str, ...]) -> tuple[str, str] | None:
    """Returns what identifies an entry of a list: the first of ``names`` that it has, and its value."""
    if not isinstance(entry, yaml.MappingNode):
        return None
    pairs = pairs_of(entry)
    found = ((name, pairs[name][1]) for name in names if name in pairs)
    return next(((name, node.value) for name, node in found if isinstance(node, yaml.ScalarNode)), None)


def _has_null(entry: yaml.Node, key: str) -> bool:
    pair = pairs_of(entry).get(key) if isinstance(entry, yaml.MappingNode) else None
    return pair is not None and is_null(pair[1])
