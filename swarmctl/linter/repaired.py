"""A spec with errors, repaired in two ways, so that rules can check the rest of it.

A wrong value becomes another likely one in each way: what rules find in both does not depend on it.
Nothing of such a spec is ever deployed.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import islice
from typing import Any, Generic, cast

import yaml
from pydantic import BaseModel, create_model

from swarmctl.diagnostics import Diagnostic, Fix, Span
from swarmctl.field_types import KEY
from swarmctl.robot_types.any_robot_type import ROS, AnyRobotType, form_of
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.ros_robot_type import RosRobotType
from swarmctl.rulebook import Severity
from swarmctl.spec.catalog import Catalog
from swarmctl.spec.model import Mode
from swarmctl.spec.model_lookup import accepts, examples_at, known_keys
from swarmctl.spec.references import at, kinds_named_at, mentions, undefined
from swarmctl.spec.unread_sections import sections_with
from swarmctl.spec.validation import FieldError, M, examined, is_contradiction
from swarmctl.spec.validation_fixes import choices, kinds_at, legal_name, without_tag
from swarmctl.suggest import guess, is_near
from swarmctl.swarm.modes import ROLES, Role
from swarmctl.yamltext.compose import pairs_of, span_of
from swarmctl.yamltext.data_changes import REMOVED, value_at, with_key, with_value, without_item
from swarmctl.yamltext.source import Loc, Source, parse

WAYS = (0, 1)
ROUNDS = 12  # a repaired value may show another that is wrong
MOST_ERRORS = 200  # that are repaired at once

_QUOTED = re.compile("`([^`]+)`")
_OTHERS = (REMOVED, "x", "y", REMOVED)  # for a name that is not unknown
_OF_ENTRIES = frozenset(
    ("hosts", "robots", "links", "types", "programs", "islands", "control", "computers", "experiments")
)
# Some of these fit most fields without choices and names.
_PROBES: tuple[Any, ...] = (
    1, 2, 4000, 5000, 0.5, 30.0, True, False, "x", "y", "/x", "/y", "192.0.2.1", "192.0.2.2", (), {},
)  # fmt: skip


class Repair(Generic[M]):
    """Makes the data of a ``model`` valid in one of `WAYS`."""

    def __init__(self, model: type[M], source: Source, way: int, unread: Iterable[str] = ()) -> None:
        self._model, self._way = model, way
        self.source = source
        self.unread = set[str]()  # sections (top-level keys) of which nothing is known
        self._tried: Counter[Loc] = Counter()
        self._likely: dict[Loc, Sequence[Any]] = {}
        self.lost = set[str]()  # names, in backticks, that may be meant where something is wrong
        self.topics = set[str]()  # that are wrong
        self.names = set[Span | None]()  # where a name is wrong or lacking
        for name in unread:
            self._give_up(name)

    def value(self) -> tuple[M | None, list[Diagnostic]]:
        """Returns the value of the sections that are known, None if that fails, and the errors on the way."""
        found: list[Diagnostic] = []
        for _ in range(ROUNDS):
            model = self._known_model
            value, errors = examined(model, self.source)
            if value is not None or len(errors) > MOST_ERRORS or any(one.error is None for one in errors):
                return value, found
            found += [one.finding for one in errors]
            for one in errors:
                self._repair_field(one)
        return None, found

    def repair(self, loc: Loc, likely: Sequence[Any]) -> None:
        """Writes this way's next ``likely`` value at ``loc``; with none left, it removes what holds it."""
        loc = tuple(loc)
        likely = self._likely.setdefault(loc, likely)
        if len(likely) == 1 and loc[0] in _OF_ENTRIES and loc[1:]:
            self.lost.add(f"`{loc[1]}`")
        mine = likely[self._way :: 2] or likely
        tried, self._tried[loc] = self._tried[loc], self._tried[loc] + 1
        if tried < len(mine):
            self._write(loc, mine[tried])
        elif len(loc) > 2 and (words := set(_words(self._at(loc[:-1])))):
            self.lost |= {f"`{word}`" for word in (*words, *map(str, loc[1:-1]))}
            self._write(loc[:-1], REMOVED)
        else:
            self._give_up(str(loc[0]))

    def repair_text(self, found: Iterable[Diagnostic]) -> None:
        """Keeps what errors of the text are about, such as a repeated key, or removes it in the other way.

        Where that may be a name of the spec, nothing is known of its section.
        """
        for one in found:
            if one.severity is Severity.ERROR:
                places = [loc for span in _spans(one) for loc in self._places.get(span, ()) if len(loc) > 2]
                for loc in places:
                    self.repair(loc, (self._at(loc), REMOVED))
                if not places:
                    for name in sections_with([one], self.source):
                        self._give_up(name)

    def repair_types(self, catalog: Catalog) -> None:
        """Gives robots another type where theirs is in a file that cannot be read."""
        robots = self.source.data.get("robots")
        for name, robot in robots.items() if isinstance(robots, dict) and catalog.broken else ():
            of_type = robot.get("type") if isinstance(robot, dict) else None
            if of_type in catalog.broken and of_type not in catalog.types:
                self.repair(("robots", name, "type"), list(catalog.types))

    def repair_names(self, found: Iterable[Diagnostic], known: Mapping[str, list[str]]) -> bool:
        """Writes names that are ``known``, by kind, for wrong ones, and the hosts that modes and robots lack.

        Returns False if nothing is left to change, or there are too many.
        """
        before = self.source.data
        self.names |= {one.span for one in found if one.severity is Severity.ERROR}
        unknown = list(islice(undefined(before, known), MOST_ERRORS + 1))
        for kinds, loc, word in unknown if len(unknown) <= MOST_ERRORS else ():
            self._repair_name(loc, word, kinds, [name for kind in kinds for name in known[kind]])
        for loc, mode in [*at(before, ("mode",)), *at(before, ("islands", "*", "mode"))]:
            self._repair_role(tuple(loc[:-1]), ROLES.get(Mode(mode)))
        if self._at(("mode",)) != Mode.SINGLE_MINDED.value:
            for loc, robot in at(self.source.data, ("robots", "*")):
                if robot.get("host") is None:
                    self.repair((*loc, "host"), self._names((*loc, "host")))
        for one in found if self.source.data is before and not unknown else ():
            for loc in self._places.get(one.span, ()):
                if one.severity is Severity.ERROR and len(loc) > 2 and self._tried[loc] < len(_OTHERS):
                    self.repair(loc, _OTHERS)
        return self.source.data is not before

    def _repair_name(self, loc: Loc, word: str, kinds: Iterable[str], names: Sequence[str]) -> None:
        """Writes another name; in a list all that are not there, or none."""
        near, listed = guess(word, names).words, self._at(loc[:-1])
        defined = [kind for kind in kinds if self._at((kind, near[0])) is not None] if len(near) == 1 else []
        if any(self._at((kind, word)) is not None for kind in kinds):
            return  # it has been renamed
        if defined and not any(mentions(self.source.data, defined[0], near[0])):
            self._rename((defined[0], near[0]), word)  # the definition is misspelt
        elif isinstance(listed, tuple) and self._way == 0:
            self._write(loc[:-1], tuple(dict.fromkeys((*(one for one in listed if one in names), *names))))
        elif isinstance(listed, tuple):
            self._write(loc, REMOVED)
        else:
            self.lost |= {f"`{one}`" for one in near} if len(near) > 1 else set()
            self.repair(loc, [*dict.fromkeys((*near, *self._names(loc), *names)), REMOVED])

    def _repair_role(self, above: Loc, role: Role | None) -> None:
        """Writes the leader or hub of a mode, without that of another mode."""
        named = {key: self._at((*above, key)) for key in ("leader", "hub")}
        for key, host in named.items():
            if host is not None and (role is None or key != role.key):
                self._write((*above, key), REMOVED)
        if role is not None and named[role.key] is None:
            given = [host for host in named.values() if host is not None]
            hosts = self._at((*above, "hosts")) if above else tuple(self._at(("hosts",)) or ())
            self.repair((*above, role.key), given or hosts or ())

    def _repair_field(self, wrong: FieldError) -> None:
        error, tagged = wrong.error, tuple(wrong.error["loc"])
        loc = without_tag(tagged)
        if is_contradiction(error):
            part = error["ctx"]["error"].at
            tagged, loc = (*tagged, *part), (*loc, *part)
        elif loc[-1:] == (KEY,):
            self._rename(loc[:-1], legal_name(str(loc[-2])))
            return
        elif error["type"] != "missing" and self._at(loc) != error["input"]:
            return  # another error's repair has changed it
        if not loc or loc[0] in self.unread:
            return
        if error["type"] == "extra_forbidden":
            given, meant = self._at(loc), guess(str(loc[-1]), known_keys(tagged[:-1], self._model)).words
            self._write(loc, REMOVED)
            if len(meant) == 1 and self._at((*loc[:-1], meant[0])) is None:
                self._write((*loc[:-1], meant[0]), given)
                self._rekey(loc, meant[0])
        elif error["type"].startswith("union_tag") and isinstance(error["input"], dict):
            kinds, given = kinds_at(loc), error["input"]
            fitting = sorted(kinds, key=lambda one: -len(set(given).intersection(known_keys((*loc, one)))))
            self.repair((*loc, "kind"), guess(str(given.get("kind")), kinds).words or fitting)
        elif loc[0] in _OF_ENTRIES and (len(loc) == 1 or (len(loc) == 2 and isinstance(loc[1], int))):
            self._give_up(str(loc[0]))  # it may be about any host and robot
        else:
            self.repair(loc, self._likely_values(wrong, tagged, loc))

    def _likely_values(self, wrong: FieldError, tagged: Loc, loc: Loc) -> list[Any]:
        """Returns what may stand in a place that is missing or wrong."""
        error, likely = wrong.error, _meant(wrong.finding.fix, wrong.finding.span)
        if loc[-1] == "topic":
            self.topics.add(str(error["input"]))
        if kinds_named_at((*loc, 0)):
            self.lost.add(f"`{loc[1]}`")
            likely += [self._names((*loc, 0)), ()]
        if len(loc) == 2 and loc[0] in _OF_ENTRIES:
            self.lost.add(f"`{loc[1]}`")
        elif error["type"] != "missing":
            likely.append(REMOVED)
        likely += choices(error) if error["type"] in ("literal_error", "enum") else []
        likely += self._names(loc)
        likely += [one for one in self._beside(loc) if one not in likely]
        examples = (*examples_at(tuple(tagged), self._model), *_PROBES)
        return [*likely, *(one for one in examples if accepts(tuple(tagged), self._model, one))]

    def _names(self, loc: Loc) -> tuple[str, ...]:
        """The names that may stand at ``loc``, those first that fewest others have there."""
        names = [name for kind in kinds_named_at(loc) for name in self._at((kind,)) or ()]
        used = Counter(str(one) for one in self._beside(loc)) if names else Counter[str]()
        return tuple(sorted(names, key=lambda one: used[one]))

    def _beside(self, loc: Loc) -> Iterator[Any]:
        """What other entries of the section have in this place, each once."""
        section, given = self._at(loc[:1]), self._at(loc)
        if loc[0] in _OF_ENTRIES and loc[1:]:
            entries = section.items() if isinstance(section, dict) else enumerate(section)
            found = (value_at(one, loc[2:]) for name, one in entries if name != loc[1])
            yield from {str(one): one for one in found if one is not None and one != given}.values()

    def _rename(self, loc: Loc, name: str | None) -> None:
        """Gives an entry another name, wherever it is mentioned."""
        kind, given = str(loc[0]), self._at(loc)
        if len(loc) != 2 or name is None or self._at((kind, name)) is not None:
            self._give_up(kind)
            return
        for place in list(mentions(self.source.data, kind, str(loc[-1]))):
            self._write(place, name)
        self._write(loc, REMOVED)
        self._write((kind, name), given)
        self._rekey(loc, name)

    def _rekey(self, loc: Loc, name: str) -> None:
        """Makes the positions of a key those of ``name``."""
        self.source = replace(self.source, root=with_key(self.source.root, loc, name), _keys={})
        self.__dict__.pop("_places", None)

    def _give_up(self, section: str) -> None:
        self.unread.add(section)
        self.source = replace(
            self.source, data={name: one for name, one in self.source.data.items() if name != section}
        )

    @property
    def _known_model(self) -> type[M]:
        if not self.unread:
            return self._model
        fields: dict[str, Any] = {
            name: (field.annotation, field)
            for name, field in self._model.model_fields.items()
            if name not in self.unread
        }
        return cast("type[M]", create_model("Part", __config__=self._model.model_config, **fields))

    @cached_property
    def _places(self) -> Mapping[Span | None, list[Loc]]:
        """Where each word of the file is in the data; one of a range may be in several places."""
        found: dict[Span | None, list[Loc]] = {}
        waiting: list[tuple[Loc, yaml.Node]] = [((), self.source.root)] if self.source.root else []
        while waiting:
            loc, node = waiting.pop()
            found.setdefault(span_of(node), []).append(loc)
            if isinstance(node, yaml.MappingNode):
                for name, (key, value) in pairs_of(node).items():
                    found.setdefault(span_of(key), []).append((*loc, name))
                    waiting.append(((*loc, name), value))
            elif isinstance(node, yaml.SequenceNode):
                waiting += [((*loc, place), item) for place, item in enumerate(node.value)]
        return found

    def _at(self, loc: Loc) -> Any:
        return value_at(self.source.data, loc)

    def _write(self, loc: Loc, value: Any) -> None:
        if loc[0] in self.unread:
            return
        root = self.source.root
        if value is REMOVED and isinstance(loc[-1], int) and isinstance(self._at(loc[:-1]), tuple):
            root = without_item(root, loc)  # those behind it keep their positions in the text
            self.__dict__.pop("_places", None)
        self.source = replace(self.source, data=with_value(self.source.data, loc, value), root=root, _keys={})


def repaired_types(catalog: Catalog, way: int) -> tuple[Catalog, list[Diagnostic]]:
    """Returns the catalog with the types beside a spec that have errors, repaired, and those on the way."""
    types: dict[str, AnyRobotType] = {}
    sources: dict[str, Source] = {}
    found: list[Diagnostic] = []
    for name, source in catalog.broken.items():
        if source is None or not isinstance(source.data, dict):
            continue
        model: type[BaseModel] = RosRobotType if form_of(source.data) == ROS else RobotType
        repair = Repair(model, source, way)
        value, wrong = repair.value()
        found += wrong
        if isinstance(value, (RobotType, RosRobotType)):
            types[name], sources[name] = value, repair.source
    return replace(catalog, types=catalog.types.under(types), sources={**catalog.sources, **sources}), found


def in_both(
    wrong: Collection[Span | None],
    ways: Sequence[Iterable[Diagnostic]],
    lost: Collection[str],
    topics: Collection[str],
) -> Iterator[Diagnostic]:
    """Yields the findings of two repaired specs that do not depend on how they were repaired.

    Nor do they name what is ``lost`` or near to wrong ``topics``, or a ``wrong`` place.
    """

    def seen(found: Diagnostic) -> tuple[object, ...]:
        return found.code, found.span, found.message, found.label, found.notes

    def is_lost(found: Diagnostic) -> bool:
        words = _QUOTED.findall(found.message) if topics else ()
        return any(word in found.message for word in lost) or any(
            _is_within(word, text) or is_near(word, text) for word in words for text in topics
        )

    others = {seen(one): one for one in ways[1]}
    for one in ways[0]:
        other = others.get(seen(one))
        if other is not None and not is_lost(one) and not any(note.span in wrong for note in one.notes):
            yield one if one.fix == other.fix else replace(one, fix=None)


def _is_within(word: str, text: str) -> bool:
    bare = word.strip("/")
    return len(bare) > 2 and bare in text


def _spans(found: Diagnostic) -> Iterator[Span | None]:
    yield from (found.span, *(note.span for note in found.notes))


def _meant(fix: Fix | None, span: Span | None) -> list[Any]:
    """The value that a fix writes in place of another one."""
    if fix is None or len(fix.edits) != 1 or fix.edits[0].span != span:
        return []
    data = parse(fix.edits[0].text, "")[0].data
    return [] if data is None else [data]


def _words(data: Any) -> Iterator[str]:
    """The texts in a mapping, and in what it holds."""
    if isinstance(data, dict):
        for value in data.values():
            yield from (value,) if isinstance(value, str) else _words(value)
