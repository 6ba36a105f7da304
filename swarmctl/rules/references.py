"""Every name that is referenced is defined, and which name a wrong one was meant to be."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cached_property
from itertools import groupby
from pathlib import Path
from typing import Any

from swarmctl.diagnostics import Diagnostic, Fix, Note
from swarmctl.field_types import KEY
from swarmctl.links.link_base import NetworkLink
from swarmctl.linter.context import RuleContext, rule
from swarmctl.spec.beside_files import advice
from swarmctl.spec.catalog import load_catalog
from swarmctl.spec.model import Mode
from swarmctl.spec.references import COMMANDERS, at, mentions, renaming, undefined
from swarmctl.spec.unread_sections import UnreadError
from swarmctl.suggest import MOST_NEAR, Guess, guess, is_near, suggestion, typing_errors
from swarmctl.yamltext.edits import make_fix, remove, rename_key, replace_value
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
        taken, required = self.taken(loc), set[str]()
        with suppress(UnreadError):
            required = self._expected(loc)
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

    def misspelt(self, meant: Guess, used: int) -> str:
        """Returns the section of a name that nothing uses, if another is ``used`` several times, or ""."""
        section, uses = self.definition(meant.only) if meant.only else ("", 0)
        return section if not uses and used > 1 else ""

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

    def taken(self, loc: Loc) -> set[str]:
        """Returns the names that cannot stand here, because they stand beside it or lead back here."""
        try:
            return self._taken(loc)
        except UnreadError:
            return set()

    def _taken(self, loc: Loc) -> set[str]:
        spec = self._spec
        if loc[0] == "hosts" and loc[2:] == ("via",):
            return self._behind(str(loc[1]))
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

    def _behind(self, host: str) -> set[str]:
        """Returns a host, and those that are reached through it."""
        found, waiting = {host}, [host]
        while waiting:
            more = self._through.get(waiting.pop(), set()) - found
            found |= more
            waiting += more
        return found

    @cached_property
    def _through(self) -> Mapping[str, set[str]]:
        """The hosts that have each host as their `via`."""
        through: dict[str, set[str]] = {}
        for name, host in self._spec.hosts.items():
            through.setdefault(host.via or "", set()).add(name)
        return through

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


_TITLES = {
    ("types",): "robot type", ("hosts",): "host", ("robots",): "robot", ("computers",): "computer",
    ("programs",): "program", COMMANDERS: "program, robot or host",
}  # fmt: skip
_LEADING_ZEROS = re.compile(r"(?<![0-9])0+(?=[0-9])")
_SHOWN = 5  # hosts of a loop in a message


@rule("REF001", names=True)
def unknown_names(context: RuleContext) -> Iterator[Diagnostic]:
    """A reference to a host, robot, robot type, computer or commander that is not defined.

    It reads the data, also of sections that have errors.
    """
    known = _defined(context)
    unknown = [(_TITLES[kinds], word, loc) for kinds, loc, word in undefined(context.source.data, known)]
    likely, folded = LikelyNames(context), set[str]()
    used: dict[str, list[Loc]] = {}
    for _, word, loc in unknown:
        used.setdefault(word, []).append(loc)
    words = {
        title: tuple(name for kind in kinds for name in known.get(kind, ()))
        for kinds, title in (_TITLES.items() if unknown else ())
    }
    unread = _unread(context) if unknown else {}
    sets = _sets(context.source.data) if unknown else frozenset()
    for span, alike in groupby(unknown, key=lambda one: context.span(*one[2])):
        same = list(alike)
        of_range = _of_a_range([word for _, word, _ in same], words[same[0][0]])
        for what, word, loc in same:
            host = _host_of(context.source.data, word) if what == "host" else ""
            meant = Guess((host,)) if host else likely.guess(word, words[what], loc)
            if host in likely.taken(loc):
                meant = Guess()
            of_robot = (f"`{word}` is a robot; its host is `{host}`",) if host else ()
            help_ = unread.get(word) if what == "robot type" else None
            misspelt = likely.misspelt(meant, len(used[word]))
            if misspelt and word in folded:
                continue
            fix = None if help_ else _fix(likely, word, loc, meant, len(used[word]))
            if word in sets and loc[-2:-1] in (("hosts",), ("of",)):
                help_ = f"write `@{word}` in quotes: it is a group or label"
                edits = replace_value(context.source, loc, f"@{word}")
                fix = make_fix(f"write `@{word}`", edits, safe=False)
            yield Diagnostic(
                "REF001",
                f"unknown {what} `{word}`",
                span,
                label="not defined",
                notes=_notes(context, meant, misspelt, used[word]),
                help=(
                    (help_,)
                    if help_
                    else of_robot or of_range or suggestion(meant, words[what], f"known {what}s")
                ),
                fix=fix,
            )
            folded.add(word)


def _notes(context: RuleContext, meant: Guess, misspelt: str, places: Sequence[Loc]) -> tuple[Note, ...]:
    """The definition that is probably misspelt, and the other places of the name."""
    if not misspelt:
        return ()
    first, *others = dict.fromkeys(context.span(*loc) for loc in places)
    definition = context.span(misspelt, str(meant.only), key=True)
    notes = (Note(definition, f"`{meant.only}` is named nowhere"), *(Note(one, "and here") for one in others))
    return notes[:_SHOWN] if first != definition else ()


def _defined(context: RuleContext) -> dict[str, Mapping[str, Any]]:
    """The names of each section; without sections that are wrong as a whole, or missing."""
    data, catalog = context.source.data, context.document.catalog
    found: dict[str, Mapping[str, Any]] = {}
    for kind in SECTIONS:
        given = data.get(kind)
        with suppress(UnreadError):
            found[kind] = given if given and isinstance(given, dict) else getattr(context.spec, kind)
    shipped = {"types": {**catalog.broken, **dict.fromkeys(catalog.types)}, "computers": catalog.computers}
    return {kind: {**one, **shipped.get(kind, {})} for kind, one in found.items()}


def _sets(data: Any) -> frozenset[str]:
    """The names of groups and labels."""
    places = (("groups", KEY), ("hosts", "*", "labels", "*"), ("robots", "*", "labels", "*"))
    return frozenset(str(name) for place in places for _, name in at(data, place))


def _host_of(data: Any, robot: str) -> str:
    """The host of a robot whose name stands where a host belongs; empty if there is none of either."""
    host = next((host for _, host in at(data, ("robots", robot, "host"))), None)
    return str(host) if any(at(data, ("hosts", str(host)))) else ""


def _of_a_range(missing: list[str], known: tuple[str, ...]) -> tuple[str, ...]:
    """Help about a range of which several names are not defined; empty for a single name."""
    shown = [f"`{one}`" for one in dict.fromkeys(missing)]
    if len(shown) < 2:
        return ()
    names = ", ".join(shown) if len(shown) <= _SHOWN else f"{shown[0]} to {shown[-1]} ({len(shown)} names)"
    bare = {_LEADING_ZEROS.sub("", one) for one in missing}
    zeros = ("the names that are defined have no leading zeros",) if bare <= set(known) else ()
    return (f"of this range these are not defined: {names}", *zeros)


def _unread(context: RuleContext) -> Mapping[str, str]:
    """Help by the name of a robot type: a file that seems to be it lies where nothing reads it."""
    folder = Path(context.document.source.path).parent / "robots"
    unread = context.document.catalog.unread
    return {name: f"`{file}` is not read; {advice(folder, name)}" for name, file in unread.items()}


def _fix(likely: LikelyNames, word: str, loc: Loc, meant: Guess, used: int) -> Fix | None:
    """Returns the fix of a name that is ``used`` so many times: of its definition if that is misspelt."""
    if not meant.only:
        return None
    source = likely.context.source
    if misspelt := likely.misspelt(meant, used):
        return renaming(meant.only, word, rename_key(source, (misspelt, meant.only), word), safe=True)
    section, uses = likely.definition(meant.only)
    certain = meant.certain and (not section or uses >= used)
    edits = replace_value(source, loc, meant.only)
    return make_fix(f"write `{meant.only}`", edits, safe=certain)


@rule("REF002")
def jump_loops(context: RuleContext) -> Iterator[Diagnostic]:
    """A chain of `via` that forms a loop."""
    hosts = context.spec.hosts
    ways = {host.via for host in hosts.values()}
    jumps = [(name, host.via) for name, host in hosts.items() if host.via is not None and name in ways]
    if not jumps:
        return
    import networkx as nx  # noqa: PLC0415  (loads for 0.1 s, and few jump hosts need one themselves)

    circles = nx.simple_cycles(nx.DiGraph(jumps))
    loops = {
        one: circle[place + 1 :] + circle[:place] for circle in circles for place, one in enumerate(circle)
    }
    for one, _ in jumps:
        if one in loops:
            rest = loops[one]
            shown = rest if len(rest) < _SHOWN else [*rest[:_SHOWN], "..."]
            way = " via ".join([one, *shown, one])
            yield Diagnostic(
                "REF002",
                f"the jump hosts of `{one}` form a loop: {way}",
                context.span("hosts", one, "via"),
                help=("make one host of the loop reachable without `via`",),
            )


@rule("REF003")
def repeated_names(context: RuleContext) -> Iterator[Diagnostic]:
    """A list that names one thing twice; if another thing is named nowhere, that may be meant."""
    spec = context.spec
    lists: list[tuple[tuple[str | int, ...], tuple[str, ...], bool]] = []
    connected = {host for _, link in context.networks for host in link.hosts}
    commanded = {robot for control in spec.control for robot in control.of}
    all_connected, all_commanded = connected >= set(spec.hosts), commanded >= set(spec.robots)
    lists += [(("links", index, "hosts"), link.hosts, all_connected) for index, link in context.networks]
    lists += [
        (("control", index, "of"), control.of, all_commanded) for index, control in enumerate(spec.control)
    ]
    lists += [(("hosts", name, "bluetooth"), host.bluetooth, False) for name, host in spec.hosts.items()]
    for loc, listed, complete in lists:
        if len(set(listed)) == len(listed):
            continue
        for place, name in enumerate(listed):
            if name in listed[:place]:
                yield Diagnostic(
                    "REF003",
                    f"`{name}` is listed twice",
                    context.span(*loc, place),
                    label="second entry",
                    notes=(Note(context.span(*loc, listed.index(name)), "first entry"),),
                    help=("write another name, or remove it",),
                    fix=make_fix(
                        f"remove the second `{name}`", remove(context.source, (*loc, place)), safe=complete
                    ),
                )


@rule("REF004")
def replaced_types(context: RuleContext) -> Iterator[Diagnostic]:
    """A robot type with the name of another, which it replaces."""
    own, shipped = context.document.catalog.sources, load_catalog().types
    used: dict[str, str] = {}
    for name, robot in context.spec.robots.items():
        used.setdefault(robot.type, name)
    for name, robot_name in used.items():
        places = [
            *(["`types` of this spec"] if name in context.spec.types else []),
            *([f"robots/{name}.yaml"] if name in own else []),
            *(["the catalog of swarmctl"] if name in shipped else []),
        ]
        if len(places) > 1:
            yield Diagnostic(
                "REF004",
                f"robot type `{name}` is in {places[0]} and in {' and in '.join(places[1:])}",
                context.span("robots", robot_name, "type"),
                label=f"means that in {places[0]}",
                notes=(Note(context.span("types", name, key=True), "it replaces the other"),)
                if name in context.spec.types
                else (),
                help=(
                    f"rename yours, for example to `lab-{name}`, here and there",
                    "or ignore this, if it is meant to replace the other",
                ),
            )
