"""Plain data against a pydantic model: the typed value, or one diagnostic per thing that does not fit."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import islice
from typing import Any, NamedTuple, TypeVar

from pydantic import BaseModel, ValidationError

from swarmctl.diagnostics import Diagnostic, Fix
from swarmctl.field_types import KEY, ConsistencyError
from swarmctl.spec.model_lookup import accepts, known_keys
from swarmctl.spec.validation_fixes import fix_for, value_within, without_tag
from swarmctl.spec.validation_messages import diagnostic
from swarmctl.suggest import nearest
from swarmctl.yamltext.edits import make_fix, replace_value
from swarmctl.yamltext.files import MAX_FINDINGS
from swarmctl.yamltext.scalars import first_invisible, named, number_or_text, without_invisible
from swarmctl.yamltext.source import Source

M = TypeVar("M", bound=BaseModel)

_FIRST = 30  # entries of each list and mapping that are looked at where too many are wrong


class FieldError(NamedTuple):
    """One thing that does not fit a model: the finding, and pydantic's error; None of a summary."""

    finding: Diagnostic
    error: Any


def validated(model: type[M], source: Source) -> tuple[M | None, list[Diagnostic]]:
    """``source`` as ``model``, or one diagnostic per thing that does not fit."""
    value, errors = examined(model, source)
    return value, [one.finding for one in errors]


def examined(model: type[M], source: Source) -> tuple[M | None, list[FieldError]]:
    """Like `validated`, with the errors that lead to the findings."""
    known = set[Any]()  # checks that raised: the next validation goes on behind them
    found: list[FieldError] = []
    while True:
        checks = len(known)
        try:
            value = model.model_validate(source.data, context=known)
        except ValidationError as errors:
            if errors.error_count() > MAX_FINDINGS:
                many = _of_many(model, source, errors.error_count())
                return None, [FieldError(finding, None) for finding in many]
            found += _behind(found, _field_errors(errors, source, model))
            if len(known) == checks or not all(is_contradiction(one.error) for one in found):
                return None, found
        else:
            return (value, []) if not found else (None, found)


def is_contradiction(error: Any) -> bool:
    """True for one of pydantic's errors about parts that are valid by themselves."""
    return isinstance(error.get("ctx", {}).get("error"), ConsistencyError)


def _behind(known: Sequence[FieldError], found: Iterable[FieldError]) -> list[FieldError]:
    """Returns what is found in models around those with known contradictions, and not compared with these."""
    places = [without_tag(tuple(one.error["loc"])) for one in known]

    def is_compared(error: Any) -> bool:
        loc, parts = without_tag(tuple(error["loc"])), error["ctx"]["error"].parts
        return any(place[: len(loc)] == loc and parts.issuperset(place[len(loc) :][:1]) for place in places)

    return [one for one in found if not (is_contradiction(one.error) and is_compared(one.error))]


def _of_many(model: type[M], source: Source, count: int) -> list[Diagnostic]:
    """What is wrong with the first entries stands for the rest: ten thousand errors are a few, repeated."""
    try:
        model.model_validate(_beginning(source.data))
    except ValidationError as errors:
        if errors.error_count() <= MAX_FINDINGS:
            return [one.finding for one in _field_errors(errors, source, model)]
    return [Diagnostic("SPEC005", f"{count} values do not fit a spec", source.span())]


def _beginning(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: _beginning(value) for key, value in islice(data.items(), _FIRST)}
    return tuple(map(_beginning, data[:_FIRST])) if isinstance(data, tuple) else data


def _field_errors(errors: ValidationError, source: Source, model: type[M]) -> list[FieldError]:
    return [
        FieldError(
            _with_fix(error, source, model, fix_for(error, source, model)),
            error,
        )
        for together in _causes(errors.errors(include_url=False), model)
        for error in _each(together)
    ]


def _each(error: Any) -> list[Any]:
    """Returns an error for each of the contradictions in one model."""
    if not is_contradiction(error):
        return [error]
    first = error["ctx"]["error"]
    return [{**error, "ctx": {**error["ctx"], "error": one}} for one in (first, *first.others)]


def _with_fix(error: Any, source: Source, model: type[M], fix: Fix | None) -> Diagnostic:
    """Returns the finding with its fix; characters that nobody sees are named first."""
    found = diagnostic(error, source, model)
    loc, given = without_tag(tuple(error["loc"])), error.get("input")
    in_key = error["type"] == "extra_forbidden" or loc[-1:] == (KEY,)
    text = str(loc[-1]) if error["type"] == "extra_forbidden" else given
    place = first_invisible(text) if isinstance(text, str) else None
    if place is None:
        found = replace(found, fix=fix)
        return found if in_key else _without_strays(error, source, model, found)
    help_ = f"its character {place + 1} is {named(text[place])}: write a blank, or remove it"
    plain = without_invisible(text)
    if fix is None and not in_key:
        fix = make_fix(f"write `{plain}`", replace_value(source, loc, plain), safe=True)
    return replace(found, help=(help_, *found.help), fix=fix)


def _without_strays(error: Any, source: Source, model: type[M], found: Diagnostic) -> Diagnostic:
    """Returns the finding with help about characters around the value, if it would be right without them."""
    tagged, given = tuple(error["loc"]), error.get("input")
    within = isinstance(given, str) and value_within(
        given, lambda text: accepts(tagged, model, number_or_text(text))
    )
    if not within:
        return found
    value, help_ = within
    fix = make_fix(
        f"write `{value}`", replace_value(source, without_tag(tagged), number_or_text(value)), safe=True
    )
    return replace(found, help=(help_,), fix=fix if "#" not in help_ else None)


def _causes(errors: Iterable[Any], model: type[BaseModel]) -> list[Any]:
    """Returns the errors that no other error causes.

    A key may be missing because it is misspelt, a list too short because its items are invalid.
    """
    kept = list(errors)
    meant = {
        (
            *error["loc"][:-1],
            nearest(str(error["loc"][-1]).partition(":")[0], known_keys(tuple(error["loc"][:-1]), model)),
        )
        for error in kept
        if error["type"] == "extra_forbidden"
    }
    parents = {tuple(error["loc"][:depth]) for error in kept for depth in range(len(error["loc"]))}
    return [
        error
        for error in kept
        if not (error["type"] == "missing" and tuple(error["loc"]) in meant)
        and not (error["type"] == "too_short" and tuple(error["loc"]) in parents)
    ]
