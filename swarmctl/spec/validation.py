"""Plain data against a pydantic model: the typed value, or one diagnostic per thing that does not fit."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from itertools import islice
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from swarmctl.spec.diagnostics import Diagnostic
from swarmctl.spec.edits import written
from swarmctl.spec.limits import MAX_FINDINGS
from swarmctl.spec.mending import (
    BOOLEANS,
    NAME,
    NUMBERS,
    choices,
    fix_for,
    is_number,
    is_too_long,
    keys_at,
    kinds_at,
    kinds_with,
    legal_name,
    noun_at,
    without_tag,
)
from swarmctl.spec.source import Loc, Source
from swarmctl.spec.suggest import did_you_mean, nearest
from swarmctl.spec.vocabulary import described, known_keys
from swarmctl.spec.words import KEY, MisfitError

M = TypeVar("M", bound=BaseModel)

_FIRST = 30  # entries of each list and mapping that are looked at where too many are wrong

_TYPES = {
    "string_type": "text",
    "int_type": "a whole number",
    "float_type": "a number",
    "bool_type": "true or false",
    "tuple_type": "a list",
    "list_type": "a list",
    "dict_type": "a mapping",
    "model_type": "a mapping",
    "model_attributes_type": "a mapping",
    "int_from_float": "a whole number",
}


def validated(model: type[M], source: Source) -> tuple[M | None, list[Diagnostic]]:
    """``source`` as ``model``, or one diagnostic per thing that does not fit."""
    try:
        return model.model_validate(source.data), []
    except ValidationError as errors:
        if errors.error_count() > MAX_FINDINGS:
            return None, _of_many(model, source, errors.error_count())
        return None, _told(errors, source, model)


def _of_many(model: type[M], source: Source, count: int) -> list[Diagnostic]:
    """What is wrong with the first entries stands for the rest: ten thousand errors are a few, repeated."""
    try:
        model.model_validate(_beginning(source.data))
    except ValidationError as errors:
        if errors.error_count() <= MAX_FINDINGS:
            return _told(errors, source, model)
    return [Diagnostic("SPEC005", f"{count} values do not fit a spec", source.span())]


def _beginning(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: _beginning(value) for key, value in islice(data.items(), _FIRST)}
    return tuple(map(_beginning, data[:_FIRST])) if isinstance(data, tuple) else data


def _told(errors: ValidationError, source: Source, model: type[M]) -> list[Diagnostic]:
    return [
        replace(_diagnostic(error, source, model), fix=fix_for(error, source, model))
        for error in _causes(errors.errors(include_url=False), model)
    ]


def _causes(errors: Iterable[Any], model: type[BaseModel]) -> list[Any]:
    """The errors without those that mending others mends: a key that is missing because it is misspelt."""
    kept = list(errors)
    meant = {
        (*error["loc"][:-1], nearest(str(error["loc"][-1]), known_keys(tuple(error["loc"][:-1]), model)))
        for error in kept
        if error["type"] == "extra_forbidden"
    }
    return [error for error in kept if error["type"] != "missing" or tuple(error["loc"]) not in meant]


def _diagnostic(error: Any, source: Source, model: type[BaseModel]) -> Diagnostic:
    kind, tagged, given = error["type"], tuple(error["loc"]), error.get("input")
    loc = without_tag(tagged)
    key = next((part for part in reversed(loc) if isinstance(part, str)), "")
    if kind == "extra_forbidden":
        return Diagnostic(
            "SPEC001",
            f"unknown key `{key}`{_inside(loc[:-1])}",
            source.span(loc, key=True),
            label="not part of the vocabulary",
            help=_help_for_unknown(key, tagged, model),
        )
    if kind == "missing" and isinstance(loc[-1], int):
        label = f"entry {loc[-1] + 1} is missing"
        return Diagnostic(
            "SPEC003", f"{_subject(loc[:-1])} has too few entries", source.span(loc[:-1]), label=label
        )
    if kind == "missing":
        told = described(tagged, model)
        return Diagnostic(
            "SPEC002",
            f"`{key}` is missing{_inside(loc[:-1])}",
            source.span(loc[:-1], key=bool(loc[:-1])),
            label=f"needs `{key}`",
            help=(f"`{key}`: {told}",) if told else (),
        )
    if kind in ("union_tag_not_found", "union_tag_invalid"):
        tag = given.get("kind") if isinstance(given, dict) else None
        if tag is None:
            return Diagnostic(
                "SPEC002",
                f"`kind` is missing{_inside(loc)}",
                source.span(loc),
                label="needs `kind`",
                help=(f"`kind` is one of {', '.join(kinds_at(loc))}",),
            )
        return Diagnostic(
            "SPEC003",
            f"{_shown(tag)} is no kind of {noun_at(loc)}",
            source.span((*loc, "kind")),
            help=did_you_mean(str(tag), kinds_at(loc), "the kinds are"),
        )
    return _bad_value(error, source, model)


def _bad_value(error: Any, source: Source, model: type[BaseModel]) -> Diagnostic:
    """A key that is right with a value that is not."""
    kind, tagged, given = error["type"], tuple(error["loc"]), error.get("input")
    loc = without_tag(tagged)
    span = source.span(loc, key=loc[-1:] == (KEY,))
    if kind in ("literal_error", "enum"):
        key = next((part for part in reversed(loc) if isinstance(part, str)), "")
        known = choices(error)
        shown = f'`"{given}"`' if str(given) in known else _shown(given)
        return Diagnostic("SPEC003", f"`{key}` cannot be {shown}", span, help=_help_for_choice(given, known))
    if kind == "too_short" and not given:
        return Diagnostic("SPEC003", f"{_subject(loc)} is empty", span, label="needs at least one entry")
    if kind in _LENGTHS:
        what, limit = _LENGTHS[kind]
        message = f"{_subject(loc)} has too {what} entries"
        return Diagnostic("SPEC003", message, span, label=limit.format(**error["ctx"]))
    if kind in _TYPES:
        quoted = kind in NUMBERS and is_number(given)
        text = written(source, loc) if quoted or type(given) in (int, float) else ""
        shown = f'`"{given}"`' if quoted else _shown(text or given)
        wrong = (
            f"is empty; it must be {_TYPES[kind]}"
            if given is None
            else f"must be {_TYPES[kind]}, not {shown}"
        )
        help_ = (_NUMBERS_THAT_RANGE,) if quoted and not text else _help_for_type(kind, given, tagged, model)
        return Diagnostic("SPEC003", f"{_subject(loc)} {wrong}", span, help=help_)
    if kind == "value_error":  # raised by a validator of ours, which puts the way to mend last
        raised = error["ctx"]["error"]
        message, _, mend = str(raised).partition("; ")
        if isinstance(raised, MisfitError):
            span = source.span((*loc, *raised.at), key=raised.at[-1:] == (KEY,))
        return Diagnostic("SPEC003", message, span, help=(mend,) if mend else ())
    message = f"{_subject(loc)} cannot be {_shown(given)}"
    if kind == "string_pattern_mismatch":
        return Diagnostic("SPEC003", message, span, help=(_pattern_help(error["ctx"]["pattern"], given),))
    if bound := _BOUNDS.get(kind):
        return Diagnostic("SPEC003", message, span, label=bound.format(**error.get("ctx", {})))
    return Diagnostic(
        "SPEC003", f"{message}: {error['msg'].replace('Input should be', 'it should be')}", span
    )


def _help_for_unknown(key: str, tagged: tuple[str | int, ...], model: type[BaseModel]) -> tuple[str, ...]:
    known = keys_at(tagged, model)
    if not known and tagged[0] == "links" and (elsewhere := kinds_with(key)):
        return (f"`{key}` belongs to links of kind {' and '.join(elsewhere)}",)
    return did_you_mean(key, known, "the keys here are")


def _inside(loc: Loc) -> str:
    """`` of `koala` in `robots` ``: the last two named steps of a place."""
    named = [part for part in loc if part != KEY]
    if not named:
        return ""
    if isinstance(named[-1], int):
        return f" in entry {named[-1] + 1} of `{named[-2]}`" if len(named) > 1 else ""
    if len(named) > 1 and isinstance(named[-2], str):
        return f" in `{named[-1]}` of `{named[-2]}`"
    if len(named) > 2 and isinstance(named[-2], int):
        return f" in `{named[-1]}` of entry {named[-2] + 1} of `{named[-3]}`"
    return f" in `{named[-1]}`"


def _subject(loc: Loc) -> str:
    named = [part for part in loc if part != KEY]
    if not named:
        return "the spec"
    if loc[-1] == KEY:
        return f"a name{_inside(named[:-1])}"
    return f"`{named[-1]}`" if isinstance(named[-1], str) else f"entry {named[-1] + 1} of `{named[-2]}`"


def _shown(given: Any) -> str:
    if given is None:
        return "empty"
    if isinstance(given, bool):
        return "`true`" if given else "`false`"
    if isinstance(given, dict):
        return "a mapping"
    if isinstance(given, tuple):
        return "a list"
    return f"`{_short(str(given))}`"


def _short(text: str) -> str:
    return text if len(text) <= 60 else text[:57] + "..."


_BOUNDS = {
    "greater_than": "must be greater than {gt:.12g}",
    "greater_than_equal": "must be {ge:.12g} or more",
    "less_than": "must be less than {lt:.12g}",
    "less_than_equal": "must be {le:.12g} or less",
    "finite_number": "must be a number that ends",
}
_LENGTHS = {"too_short": ("few", "{min_length} at least"), "too_long": ("many", "{max_length} at most")}


_NUMBERS_THAT_RANGE = (
    "a range in quotes is text; name each number, {each: [8081, 8082]}, or put it on a line without quotes"
)


def _help_for_type(
    kind: str, given: Any, loc: tuple[str | int, ...], model: type[BaseModel]
) -> tuple[str, ...]:
    if kind == "string_type" and isinstance(given, (int, float)):
        return ("put it in quotes to make it text",)
    if kind in NUMBERS and is_number(given):
        return ("take the quotes away to make it a number",)
    if kind in NUMBERS and is_too_long(given):
        return ("no number here has more than 18 digits",)
    if kind == "bool_type" and str(given).lower() in BOOLEANS:
        return (f"write `{BOOLEANS[str(given).lower()]}`",)
    if _TYPES[kind] == "a list" and isinstance(given, str):
        return (f"put it in brackets: [{_short(given)}]",)
    if kind == "model_attributes_type":  # an entry of a union, told apart by its kind
        return (f"it begins with `kind`, one of {', '.join(kinds_at(loc))}",)
    told = described(loc, model) if loc else ""
    keys = ", ".join(f"`{key}`" for key in known_keys(loc, model)) if _TYPES[kind] == "a mapping" else ""
    return tuple(filter(None, (told and f"`{loc[-1]}`: {told}", keys and f"its keys are {keys}")))


def _help_for_choice(given: Any, choices: list[str]) -> tuple[str, ...]:
    if str(given) in choices:
        return (f"write {given} without quotes",)
    return (
        (f"it can only be `{choices[0]}`",)
        if len(choices) == 1
        else did_you_mean(str(given), choices, "it is one of")
    )


_PATTERNS = {
    NAME: "names are lower-case letters, digits and hyphens, a letter first, 31 at most",
    "^[a-z_][a-z0-9_-]{0,31}$": "accounts are lower-case letters, digits, _ and hyphens, a letter or _ first",
    "^hci[0-9]{1,2}$": "adapters are called hci0, hci1, ...",
    "^[A-Za-z0-9:._-]{1,64}$": "letters, digits and : . _ - only, as `udevadm info -a` shows it",
    "^[A-Za-z_][A-Za-z0-9_]*$": "environment variables are letters, digits and _, no digit first",
    "^[a-z][a-z0-9_]*$": "ROS packages are lower-case letters, digits and _, a letter first",
    "^[A-Za-z0-9_][A-Za-z0-9_.-]*$": "a file name of letters, digits and _ . -",
    "^(/[A-Za-z0-9_][A-Za-z0-9._-]*)+$": "a folder has its whole path, like /home/robot/catkin_ws",
    r"^[^\x00-\x1f\x7f-\x9f\u2028\u2029\ufffe\uffff]*$": "text on one line, without control characters",
    "^[a-z][a-z0-9.-]{0,30}$": "robot types are lower-case letters, digits, dots and hyphens, a letter first",
    "^[a-z][a-z0-9_]{0,30}$": "lower-case letters, digits and _, a letter first, 31 at most",
    "^[A-Z]{2,8}[0-9]{3}$": "a rule is written like SET001; `swarmctl rules` lists them",
    "^[0-9a-fA-F]{4}$": "four hexadecimal digits, in quotes",
    "^[A-Za-z~/][A-Za-z0-9_/]*$": "a ROS name has letters, digits, _ and /, a letter first",
    "^[a-z][a-z0-9_]*/[A-Z][A-Za-z0-9]*$": "a message type is written package/Type, like geometry_msgs/Twist",
}


def _pattern_help(pattern: str, given: str) -> str:
    told = _PATTERNS.get(pattern, f"it must match {pattern}")
    name = legal_name(given) if pattern == NAME else None
    return f"write it `{name}`: {told}" if name else told
