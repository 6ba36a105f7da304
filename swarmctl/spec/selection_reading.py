"""Where selections stand in the tree of a spec, and what they can name there. The tree may have errors."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import yaml

from swarmctl.spec.selection_candidates import (
    Candidates,
    IslandFacts,
    ProgramFacts,
    RobotFacts,
)
from swarmctl.yamltext.compose import pairs_of
from swarmctl.yamltext.selection_text import is_selection

GROUPS = "groups"
# The lists of hosts or robots, by section and key.
LISTS = {
    ("links", "hosts"): "hosts",
    ("islands", "hosts"): "hosts",
    ("programs", "hosts"): "hosts",
    ("programs", "robots"): "robots",
    ("control", "of"): "robots",
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
