"""Whatever is written into a field of a spec or of a robot type: its finding helps to correct it."""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import pytest
from pydantic import BaseModel
from pydantic_core._pydantic_core import list_all_errors

from swarmctl.diagnostics import Diagnostic
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.spec.catalog import load_catalog
from swarmctl.spec.load import load_text
from swarmctl.spec.model import Spec
from swarmctl.spec.validation import validated
from swarmctl.yamltext.source import parse
from tests.spec.every_field import Loc, Node, Written, out_of_range, samples, written, wrong_values

MODELS = (Spec, RobotType)
ELSEWHERE = "Spec.include"  # read before the model, and tested below
_PLACE = re.compile(r"\\\{\w+\\\}")  # of a value, in the template of a message
PYDANTICS = [
    re.compile(_PLACE.sub(".+", re.escape(one["message_template_python"]))) for one in list_all_errors()
]
REGULAR_EXPRESSION = re.compile(r"\^\[|\]\*|\]\{|\[\^|\(\?|\\x..-|\$/")
BOUND = re.compile(r"must be (greater than |less than )?[-0-9]")
LONGEST = 500  # letters of all texts of a finding
Wrong = Mapping[Loc, str]


@dataclass(frozen=True)
class Case:
    """One finding, and the place of the text in whose line it stands."""

    found: Diagnostic
    loc: Loc
    node: Node | None
    value: str

    @property
    def texts(self) -> tuple[str, ...]:
        return (self.found.message, self.found.label, *self.found.help)


def rounds(root: Node, seen: set[str]) -> Iterator[tuple[Wrong, bool]]:
    """Yields wrong values by their places, none within another; True if each of them is out of range.

    A field that stands at several places is in ``seen`` after the first.
    """
    groups: dict[tuple[int, bool], list[tuple[Loc, Node]]] = defaultdict(list)
    for loc, node in root.below():
        if node.owner not in seen and node.owner != ELSEWHERE:
            seen.add(node.owner)
            deepest = max((len(below) for below, _ in node.below()), default=0)
            groups[deepest, loc[-1] == "kind"].append((loc, node))
    for group in groups.values():
        for values, is_range in ((wrong_values, False), (out_of_range, True)):
            waiting = {loc: list(values(node)) for loc, node in group}
            while waiting := {loc: left for loc, left in waiting.items() if left}:
                yield {loc: left.pop() for loc, left in waiting.items()}, is_range


def findings(model: type[BaseModel], text: Written) -> list[Diagnostic]:
    return validated(model, parse(text.text, "swarm.yaml")[0])[1]


def is_about(loc: Loc, wrong: Loc) -> bool:
    """True if a finding at ``loc`` is about a wrong value within, or about one that stands beside it."""
    return wrong[: len(loc)] == loc or () != wrong[:-1] == loc[: len(wrong) - 1]


def faults(case: Case) -> Iterator[str]:
    """What is wrong with the texts of one finding."""
    key = next((step for step in reversed(case.loc) if isinstance(step, str)), "")
    unit = case.node.unit if case.node else None
    everything = "\n".join(case.texts)
    if any(one.search(text) for one in PYDANTICS for text in case.texts):
        yield "has pydantic's words"
    if REGULAR_EXPRESSION.search(everything):
        yield "shows a regular expression"
    if not re.search(rf"`{re.escape(key)}`|\bkind\b|`one`", case.found.message):
        yield f"does not name `{key}`"
    if not (case.found.help or case.found.fix or case.found.label or " must be " in case.found.message):
        yield "does not say what to write"
    if (
        unit
        and BOUND.match(case.found.label)
        and not case.found.label.replace(" or more", "").replace(" or less", "").endswith(f" {unit.symbol}")
    ):
        yield "has a range without a unit"
    if not all(text.isprintable() for text in case.texts):
        yield "has a character that nobody sees"
    if len(everything) > LONGEST:
        yield "is too long"


@pytest.mark.parametrize("model", MODELS)
def test_a_wrong_value_of_any_field_gets_help(model: type[BaseModel], counted: list[str]) -> None:
    seen: set[str] = set()
    hits: Counter[str] = Counter()
    poor: dict[str, str] = {}  # one of each kind
    missed: list[str] = []
    for root in samples(model):
        nodes = dict(root.below())
        usual = {one.message for one in findings(model, written(root, {}))}  # parts that do not fit together
        for wrong, is_range in rounds(root, seen):
            text = written(root, wrong)
            met: set[Loc] = set()
            for found in findings(model, text):
                assert found.span is not None
                loc = text.places[found.span.line]
                met.add(loc)
                counted.append(found.message)
                if loc in wrong:
                    case = Case(found, loc, nodes[loc], wrong[loc])
                    hits[nodes[loc].owner] += 1
                    poor |= {
                        f"{fault}: {nodes[loc].owner}": str((case.value[:60], *case.texts))
                        for fault in faults(case)
                    }
                elif found.message not in usual and not any(is_about(loc, one) for one in wrong):
                    poor[f"stands at another place: {loc}"] = found.message
            missed += [
                f"{nodes[loc].owner}: {value[:60]}"
                for loc, value in wrong.items()
                if is_range and loc not in met
            ]
    assert poor == {}
    assert missed == []
    assert {owner for owner in seen if not hits[owner]} == set()
    assert len(seen) >= 200


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("slip", ["{}x", "x{}", "{}-{}"])
def test_a_misspelt_key_of_any_model_gets_help(model: type[BaseModel], slip: str) -> None:
    for root in samples(model):
        nodes = dict(root.below())
        fixed = {loc for loc in nodes if isinstance(loc[-1], str) and not nodes.get(loc[:-1], root).own_names}
        for depth in {len(loc) for loc in fixed}:
            names = {
                loc: slip.format(loc[-1], loc[-1]) for loc in fixed if len(loc) == depth and loc[-1] != "kind"
            }
            text = written(root, {}, names)
            found = {text.places[one.span.line]: one for one in findings(model, text) if one.span}
            for loc, name in names.items():
                assert found[loc].message.startswith(f"unknown key `{name}`")
                assert found[loc].help or found[loc].fix


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("name", ["Bad Key", '"1"', "Ä", '"a\\tb"'])
def test_a_wrong_name_of_any_mapping_gets_help(model: type[BaseModel], name: str) -> None:
    for root in samples(model):
        named = {loc: node.entries[0][0] for loc, node in root.below() if node.own_names}
        for loc, first in named.items():
            text = written(root, {}, {(*loc, str(first)): name})
            wrong = [
                one
                for one in findings(model, text)
                if one.span and text.places[one.span.line] == (*loc, first)
            ]
            for one in wrong:
                assert not list(faults(Case(one, loc, None, name))), one


@pytest.mark.parametrize(
    "value", ["null", "true", "7.5", '""', "{}", "{one: 1}", "[1]", "two", '"\\t"', ".nan"]
)
def test_a_wrong_include_gets_help(value: str) -> None:
    _, found = load_text(f"version: 1\nname: lab\ninclude: {value}\n", "swarm.yaml", load_catalog())
    first = found[0]
    assert first.span is not None
    assert (first.span.line, first.code[:3]) == (3, "INC")
    assert first.help
    assert first.message.isprintable()
