"""Makes data with errors valid, so that what is right in it can be checked too.

A misspelt key or value becomes what its fix writes, another one what may stand there, or it is left out. Each
place can be repaired in several ways, and repairs with different numbers choose different ones: what is found
in all of them does not follow from a repair. Nothing repaired is ever deployed.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Generic

import yaml
from pydantic import BaseModel

from swarmctl.diagnostics import Diagnostic, Severity, Span
from swarmctl.field_types import KEY
from swarmctl.robot_types.any_robot_type import ROS, AnyRobotType, form_of
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.ros_robot_type import RosRobotType
from swarmctl.spec.catalog import Catalog, load_catalog
from swarmctl.spec.model import DRIVER
from swarmctl.spec.stand_ins import absent_keys, likely_kinds, most_alike, stand_ins
from swarmctl.spec.validation import M, Misfit, examined, is_contradiction
from swarmctl.spec.validation_fixes import choices, kinds_at, without_tag
from swarmctl.yamltext.compose import pairs_of, span_of
from swarmctl.yamltext.scalars import number_or_text
from swarmctl.yamltext.source import Loc, Source, source_of
from swarmctl.yamltext.tree_changes import REMOVED, Change, changed, changes_of

MOST_FAULTS = 200  # of one round; with more of them nothing is repaired
_ROUNDS = 12
_MOST_TYPES = 40  # that are repaired; a lab has a few of its own
_MOST_KEYS = 5  # that an unknown one may be
_SECTIONS = frozenset({"hosts", "robots", "links", "programs", "control", "islands"})

Ways = Sequence[Sequence[Change]]  # each way to repair one place, as changes that belong together


class Repair(Generic[M]):
    """One way to make the tree of a ``model`` valid. It collects the findings that appear meanwhile."""

    def __init__(
        self,
        model: type[M],
        root: yaml.Node,
        path: str,
        texts: Mapping[str, str],
        number: int,
        *,
        complete: bool = True,
        trees: Sequence[yaml.Node] = (),
    ) -> None:
        self.model, self.path, self.texts, self.number = model, path, texts, number
        self.root, self.trees = root, trees
        self.found: Counter[Diagnostic] = Counter()  # a range may make the same one for each element
        self.most_ways = 1  # of the place that can be repaired in most ways
        self.whole = complete  # False once a section of the spec is not what the text has
        self.open: set[str] = set()  # sections with a name that is wrong: any may be meant
        self.lost: set[str] = set()  # names whose entries were left out
        self._places: dict[tuple[str, int], list[Span]] = {}  # what was changed, by file and line
        self._tried: Counter[Loc] = Counter()
        self._made = 0
        self._left_out: set[Loc] = set()  # places that may be missing because their keys were left out
        self._removed: set[Loc] = set()  # places that are missing because they were removed

    def value(self) -> tuple[M | None, Source]:
        """Returns the model and its source, repaired; None if that does not succeed."""
        for _ in range(_ROUNDS):
            source, wrong = source_of(self.root, self.path, self.texts, self.trees)
            self.report(wrong)
            self._open_sections(one.span for one in wrong if one.severity is Severity.ERROR)
            if source.data is None:
                return None, source
            value, misfits = examined(self.model, source)
            self.report(one.finding for one in misfits if not self._is_consequence(one.error))
            if value is not None:
                return value, source
            if len(misfits) > MOST_FAULTS or any(one.error is None for one in misfits):
                return None, source
            places = {tuple(one.error["loc"]): one for one in reversed(misfits)}  # contradictions share one
            ways = [self._ways(one, source) for one in reversed(places.values())]
            if not self.change([one for one in ways if one]) or not any(ways):
                return None, source
        return None, source

    def report(self, found: Iterable[Diagnostic]) -> None:
        """Keeps findings, except those about what was changed, and those of a place under another name."""
        known = {(one.code, one.span) for one in self.found}
        new = (one for one in found if (one.code, one.span) not in known or one in self.found)
        self.found |= Counter(one for one in new if not self.is_changed(one))

    def mark(self, found: Iterable[Diagnostic]) -> None:
        """Counts the places of findings as changed: the tree has something likely there."""
        spans = [one.span for one in found if one.severity is Severity.ERROR]
        for span in spans:
            if span is not None:
                self._mark(span)
        self._open_sections(spans)

    def _open_sections(self, spans: Iterable[Span | None]) -> None:
        """Notes the sections in which one of ``spans`` is a name."""
        wrong = set(spans)
        if not wrong or not isinstance(self.root, yaml.MappingNode):
            return
        for name, (_, section) in pairs_of(self.root).items():
            entries = section.value if isinstance(section, yaml.MappingNode) else ()
            if name in _SECTIONS and any(span_of(key) in wrong for key, _ in entries):
                self.open.add(name)

    def _mark(self, place: Span) -> None:
        for line in range(place.line, place.end_line + 1):
            self._places.setdefault((place.file, line), []).append(place)

    def is_changed(self, found: Diagnostic) -> bool:
        """Returns True for a finding that shows a changed place, or names what was left out."""
        if any(f"`{name}`" in found.message for name in self.lost):
            return True
        spans = [span for span in (found.span, *(note.span for note in found.notes)) if span is not None]
        return any(
            _within(span, place) for span in spans for place in self._places.get((span.file, span.line), ())
        )

    def change(self, faults: Sequence[Ways]) -> bool:
        """Repairs each fault in one of its ways; False if one of them has none."""
        chosen: list[Change] = []
        for ways in faults:
            if not ways:
                return False
            self.most_ways = max(self.most_ways, len(ways))
            chosen += ways[self.number % len(ways)]
        renamed = {(*one.loc[:-1], one.key) for one in chosen if one.key is not None}
        chosen = [one for one in chosen if one.loc not in renamed]  # a missing key is the renamed one
        for one in chosen:
            if len(one.loc) == 1 and one.key is None and self._is_section(str(one.loc[0])):
                self.whole = False
            if one.value is REMOVED:
                self._removed.add(one.loc)
                if len(one.loc) == 2:
                    self.lost.add(str(one.loc[1]))
        self.root, places = changed(self.root, chosen)
        for place in places:
            self._mark(place)
        return True

    def _is_section(self, key: str) -> bool:
        """True for a section, or for something that may be a misspelt one."""
        pairs = pairs_of(self.root) if isinstance(self.root, yaml.MappingNode) else {}
        is_known = key in self.model.model_fields
        return key in _SECTIONS or (not is_known and isinstance(pairs[key][1], yaml.CollectionNode))

    def _is_consequence(self, error: Any) -> bool:
        if error is None:
            return False
        loc = without_tag(tuple(error["loc"]))
        if is_contradiction(error):
            parts = error["ctx"]["error"].parts
            return any(
                place[: len(loc)] == loc and parts.issuperset(place[len(loc) :][:1])
                for place in self._removed
            )
        left_out = loc[:-1] in self._left_out or (len(loc) == 1 and not self.whole)
        is_removed = any(loc[: len(place)] == place for place in self._removed)
        return error["type"] == "missing" and (left_out or is_removed)

    def lose(self, kinds: Collection[str], name: str) -> None:
        """Notes an unknown name of one of ``kinds``, which may be one that is wrong in its section."""
        if self.open & set(kinds):
            self.lost.add(name)

    def _ways(self, misfit: Misfit, source: Source) -> Ways:
        """Returns the ways to repair a misfit. Where one was tried in vain: the next; at last, no holder."""
        loc = without_tag(tuple(misfit.error["loc"]))
        if misfit.error["type"] == "extra_forbidden":
            self._left_out.add(loc[:-1])
        if loc[-1:] == (KEY,) and misfit.finding.fix is None:
            self.open.add(str(loc[0]))
        self._made += 1
        ways = _ways_of(misfit, loc, source, self.model, 1000 * self.number + self._made)
        at = misfit.error["ctx"]["error"].at if is_contradiction(misfit.error) else ()
        place = (*loc, *at)
        tried = self._tried[place]
        self._tried[place] += 1
        if tried == 0 and ways:
            return ways
        if tried < len(ways):
            return [ways[(self.number + tried) % len(ways)]]
        holder = loc[:-1]
        return [[Change(holder, value=REMOVED)]] if holder else []


def _ways_of(misfit: Misfit, loc: Loc, source: Source, model: type[BaseModel], number: int) -> Ways:
    error, fix = misfit.error, misfit.finding.fix
    kind, tagged, given = error["type"], tuple(error["loc"]), error.get("input")
    if (
        fix is not None
        and source.root is not None
        and (changes := changes_of(source.root, fix.edits, source.trees))
    ):
        return [changes]
    if kind == "extra_forbidden":
        return _without_key(loc, tagged[:-1], source, model, number)
    if is_contradiction(error):  # which part is wrong is open, except in a driver
        at = error["ctx"]["error"].at
        if at and (ROS in tagged or DRIVER in tagged):
            return [[Change((*loc, *at), value=REMOVED)]]
        return [[Change(loc[:2], value=REMOVED)]] if loc[:1] == ("types",) else []
    if kind in ("union_tag_not_found", "union_tag_invalid"):
        return [[Change((*loc, "kind"), value=one)] for one in likely_kinds(given, kinds_at(loc))]
    if not loc:
        return []
    if loc[-1] == KEY:
        return [[Change(loc[:-1], key=f"standin{number}")]]
    values, may_be_left_out = stand_ins(tagged, model, number)
    if kind in ("literal_error", "enum"):
        values = [number_or_text(one) for one in choices(error)]
    if kind == "too_short":
        items, _ = stand_ins((*tagged, 0), model, number)
        values = [(*given, item) for item in items]
    bounds = [error["ctx"][key] for key in ("ge", "le") if key in error.get("ctx", {})]
    left_out = [REMOVED] if may_be_left_out and kind != "missing" else []
    return [[Change(loc, value=value)] for value in (*bounds, *left_out, *values)]


def _without_key(
    loc: Loc, holder: tuple[str | int, ...], source: Source, model: type[BaseModel], number: int
) -> Ways:
    """A key that nobody knows is left out; or it is one of those that are not there."""
    beside: Any = source.data
    for step in loc[:-1]:
        beside = beside[step]
    given, absent = beside[loc[-1]], absent_keys(holder, model, beside)
    if isinstance(given, (dict, tuple)):
        return [[Change(loc, key=key)] for key in most_alike(given, holder, absent, model)] or _left_out(loc)
    fitting = [key for key in absent if type(stand_ins((*holder, key), model, number)[0][0]) is type(given)]
    return [*_left_out(loc), *([Change(loc, key=key)] for key in fitting[:_MOST_KEYS])]


def _left_out(loc: Loc) -> Ways:
    return [[Change(loc, value=REMOVED)]]


def _within(span: Span, place: Span) -> bool:
    return (place.line, place.column) <= (span.line, span.column) and (span.end_line, span.end_column) <= (
        place.end_line,
        place.end_column,
    )


def repaired_catalog(catalog: Catalog, number: int) -> tuple[Catalog, list[Diagnostic]]:
    """Returns the catalog with its broken types repaired, and the findings that appear meanwhile.

    A type that cannot be repaired, or comes after many, is a shipped one; which one depends on ``number``.
    """
    types, found = dict[str, AnyRobotType](), list[Diagnostic]()
    for place, (name, source) in enumerate(catalog.broken.items()):
        model = RosRobotType if source is not None and form_of(source.data) == ROS else RobotType
        if place < _MOST_TYPES and source is not None:
            robot_type, reported = _repaired_type(model, source, number)
            found += reported
        else:
            robot_type = None
        shipped = [one for one in load_catalog().types.values() if isinstance(one, model)]
        types[name] = robot_type or shipped[(number + place) % len(shipped)]
    return replace(catalog, types=catalog.types.under(types)), found


def _repaired_type(
    model: type[AnyRobotType], source: Source, number: int
) -> tuple[AnyRobotType | None, Iterable[Diagnostic]]:
    if source.root is None:
        return None, ()
    repair = Repair(model, source.root, source.path, source.texts, number)
    robot_type, _ = repair.value()
    return robot_type, repair.found.elements()
