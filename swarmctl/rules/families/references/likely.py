"""Which name a wrong one was meant to be: by its letters, and by what the spec says elsewhere."""

from __future__ import annotations

from functools import cached_property

from swarmctl.links.link_base import NetworkLink
from swarmctl.rules.context import RuleContext
from swarmctl.spec.model import Mode
from swarmctl.spec.references import at, mentions
from swarmctl.spec.sound_sections import UnsoundError
from swarmctl.suggest import MOST_NEAR, Guess, guess, is_near, typing_errors
from swarmctl.yamltext.source import Loc

SECTIONS = ("hosts", "robots", "programs", "types", "computers")


class LikelyNames:
    """Guesses names: a line and its robot's `host` agree, and no list names anything twice."""

    def __init__(self, context: RuleContext) -> None:
        self.context = context
        self._spec = context.spec
        self._definitions: dict[str, tuple[str, int]] = {}

    def guess(self, word: str, known: tuple[str, ...], loc: Loc) -> Guess:
        """Returns what ``word`` at ``loc`` was probably meant to be."""
        try:
            taken, required = self._taken(loc), self._expected(loc)
        except UnsoundError:
            taken, required = set(), set()
        meant = guess(word, known)
        if not taken.isdisjoint(meant.words):
            meant = guess(word, tuple(one for one in known if one not in taken))
        expected = sorted(required.intersection(known) - taken)
        if not expected:
            return self._preferred(meant, loc)
        near = tuple(one for one in expected if is_near(word, one))
        if not near and meant.words:
            return Guess((meant.words[0], expected[0]))  # they contradict each other
        if len(near) != 1:
            return Guess(near or tuple(expected[:MOST_NEAR]))
        errors = typing_errors(word, near[0])
        if any(typing_errors(word, other) < errors for other in meant.words):
            return Guess((meant.words[0], near[0]))
        return Guess(near, certain=errors <= 1)

    def definition(self, name: str) -> tuple[str, int]:
        """Returns the section of the spec that defines a name, or "", and how many places use the name."""
        if name not in self._definitions:
            data = self.context.source.data
            kind = next((one for one in SECTIONS if any(at(data, (one, name)))), "")
            uses = mentions(data, kind, name) if kind else ()
            self._definitions[name] = kind, sum(1 for _ in uses)
        return self._definitions[name]

    def _expected(self, loc: Loc) -> set[str]:
        """Returns the names that other places require here; none if they require nothing."""
        spec = self._spec
        if loc[0] == "robots" and loc[2:] == ("host",):
            return {line.host for _, line in self.context.lines_of[str(loc[1])]}
        if loc[0] != "links" or not isinstance(loc[1], int):
            return set()
        link = spec.links[loc[1]]
        if isinstance(link, NetworkLink):
            return set()
        if loc[2] == "robot":
            return {name for name in self._without_line if spec.robots[name].host == link.host}
        robot = spec.robots.get(link.robot)
        own = robot.host if robot is not None else None
        host = spec.leader if own is None and spec.mode is Mode.SINGLE_MINDED else own
        return {host} if host is not None else set()

    def _taken(self, loc: Loc) -> set[str]:
        """Returns the names that cannot stand here because they stand beside it."""
        spec = self._spec
        if loc[0] == "islands" and loc[2] == "hosts":
            return self._on_islands
        if loc[0] == "control" and loc[2] == "of" and isinstance(loc[1], int):
            return set(spec.control[loc[1]].of)
        if loc[0] == "links" and isinstance(loc[1], int):
            link = spec.links[loc[1]]
            if isinstance(link, NetworkLink):
                return set(link.hosts)
            if loc[2] == "robot":
                return self._with_line
        return set()

    def _preferred(self, meant: Guess, loc: Loc) -> Guess:
        """Of equally near hosts of a program, that of its robot."""
        if loc[0] != "programs" or loc[2:] != ("host",):
            return meant
        robot = self._spec.robots.get(self._spec.programs[str(loc[1])].robot or "")
        own = robot.host if robot is not None else None
        return Guess((own,)) if own is not None and own in meant.words else meant

    @cached_property
    def _with_line(self) -> set[str]:
        return {link.robot for _, link in self.context.lines}

    @cached_property
    def _without_line(self) -> list[str]:
        return [name for name in self._spec.robots if name not in self._with_line]

    @cached_property
    def _on_islands(self) -> set[str]:
        return {host for island in self._spec.islands.values() for host in island.hosts}
