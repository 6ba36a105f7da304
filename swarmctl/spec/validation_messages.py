"""The message, place and help of each of pydantic's errors, for the person who wrote the file."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel

from swarmctl.diagnostics import Diagnostic
from swarmctl.field_types import ADAPTER, KEY, NAME, ConsistencyError
from swarmctl.robot_types.plausibility import meant as length_meant
from swarmctl.spec.model_lookup import accepts, described, known_keys, place_of, unit_at
from swarmctl.spec.validation_fixes import (
    BOOLEANS,
    NUMBERS,
    choices,
    is_list_in_braces,
    is_number,
    is_too_long,
    keys_at,
    kinds_at,
    kinds_with,
    legal_name,
    look_alike,
    names_run_together,
    noun_at,
    only_key,
    unescaped,
    without_tag,
)
from swarmctl.suggest import FOREIGN, did_you_mean, guess, suggestion
from swarmctl.text_patterns import words_of
from swarmctl.units import Unit
from swarmctl.yamltext.edits import written
from swarmctl.yamltext.scalars import legible, named
from swarmctl.yamltext.source import Loc, Source

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
_BOUNDS = {
    "greater_than": ("must be greater than {gt:.12g}", ""),
    "greater_than_equal": ("must be {ge:.12g}", " or more"),
    "less_than": ("must be less than {lt:.12g}", ""),
    "less_than_equal": ("must be {le:.12g}", " or less"),
    "finite_number": ("must be a finite number", ""),
    "string_too_short": ("needs {min_length} or more characters", ""),
    "string_too_long": ("must have {max_length} characters or fewer", ""),
}
_LONG_VALUE = re.compile("`([^`]{61,})`")
_LENGTHS = {"too_short": ("few", "{min_length} at least"), "too_long": ("many", "{max_length} at most")}
_PLAIN_WORD = re.compile(r"[A-Za-z0-9_./+-][A-Za-z0-9_./+:=@-]*", re.ASCII)
_SIGNS = tuple("@*&!%`|>")  # no plain text of YAML begins with one
_MASTER_URI = "leave it out: the master's URI comes from the address of the hub or leader, and `master_port`"
_NUMBERS_THAT_RANGE = (
    "a range in quotes is text; name each number, {each: [8081, 8082]}, or put it on a line without quotes"
)


def diagnostic(error: Any, source: Source, model: type[BaseModel]) -> Diagnostic:
    """Returns what one of pydantic's errors means for a user, without its fix."""
    kind, tagged, given = error["type"], tuple(error["loc"]), error.get("input")
    loc = without_tag(tagged)
    key = next((part for part in reversed(loc) if isinstance(part, str)), "")
    if kind == "extra_forbidden":
        return Diagnostic(
            "SPEC001",
            f"unknown key `{key}`{_inside(loc[:-1])}",
            source.span(loc, key=True),
            label="not a key here",
            help=_help_for_unknown(key, given, tagged, model),
        )
    if kind == "missing" and isinstance(loc[-1], int):
        label = f"entry {loc[-1] + 1} is missing"
        return Diagnostic(
            "SPEC003", f"{_subject(loc[:-1])} has too few entries", source.span(loc[:-1]), label=label
        )
    if kind == "missing":
        text = described(tagged, model)
        return Diagnostic(
            "SPEC002",
            f"`{key}` is missing{_inside(loc[:-1])}",
            source.span(loc, key=bool(loc[:-1])),
            label=f"needs `{key}`",
            help=(f"`{key}`: {text}",) if text else (),
        )
    if kind in ("union_tag_not_found", "union_tag_invalid"):
        tag = given.get("kind") if isinstance(given, dict) else None
        if tag is None:
            return Diagnostic(
                "SPEC002",
                f"`kind` is missing{_inside(loc)}",
                source.span((*loc, "kind")),
                label="needs `kind`",
                help=(f"`kind` is one of {', '.join(kinds_at(loc))}",),
            )
        return Diagnostic(
            "SPEC003",
            f"{_shown(tag)} is not a kind of {noun_at(loc)}",
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
        known = choices(error)
        shown = f'`"{given}"`' if str(given) in known else _shown(given)
        message = f"{_subject(loc)} cannot be {shown}"
        return Diagnostic("SPEC003", message, span, help=_help_for_choice(given, known))
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
        meant = text if kind == "string_type" and text else given
        help_ = (_NUMBERS_THAT_RANGE,) if quoted and not text else _help_for_type(kind, meant, tagged, model)
        return Diagnostic("SPEC003", f"{_subject(loc)} {wrong}", span, help=help_)
    if kind == "value_error":  # raised by a validator of ours, which puts the fix last
        raised = error["ctx"]["error"]
        message, _, make_fix = str(raised).partition("; ")
        message = _LONG_VALUE.sub(lambda found: f"`{_short(found[1])}`", legible(message))
        if isinstance(raised, ConsistencyError):
            span = source.span((*loc, *raised.at), key=raised.at[-1:] == (KEY,))
        elif not message.startswith(_subject(loc)):
            message = f"{_subject(loc)}: {message}"
        return Diagnostic("SPEC003", message, span, help=(make_fix,) if make_fix else ())
    message = f"{_subject(loc)} cannot be {_shown(given)}"
    if kind == "string_pattern_mismatch":
        if words := names_run_together(source, loc, given):
            return Diagnostic("SPEC003", message, span, help=(f"write commas: {', '.join(words)}",))
        return Diagnostic("SPEC003", message, span, help=(_pattern_help(error["ctx"]["pattern"], given),))
    unit = unit_at(tagged, model)
    bound = _bound(kind, error.get("ctx", {}), unit)
    if unit and isinstance(text := _at(source.data, loc), str):
        message = f"{_subject(loc)} cannot be {_shown(text)}"
    if kind == "less_than_equal" and loc[-1] in ("wheel_separation", "wheel_radius"):
        return Diagnostic("SPEC003", message, span, label=bound, help=(length_meant(given, 0.001, 1),))
    text = described(tagged, model)
    return Diagnostic("SPEC003", message, span, label=bound, help=(text,) if text and not bound else ())


def _bound(kind: str, context: Mapping[str, Any], unit: Unit | None) -> str:
    """What the value must be to be in its range, in the unit of its key."""
    text, more = _BOUNDS.get(kind, ("", ""))
    named = f" {unit.symbol}" if unit and "{" in text else ""
    return f"{text.format(**context)}{named}{more}"


def _at(data: Any, loc: Loc) -> Any:
    """What the text has at ``loc``: the error has it in the unit of its key."""
    for step in loc:
        inside = isinstance(data, dict) and step in data
        inside = inside or (isinstance(data, tuple) and isinstance(step, int) and step < len(data))
        data = data[step] if inside else None
    return data


def _help_for_unknown(
    key: str, given: Any, tagged: tuple[str | int, ...], model: type[BaseModel]
) -> tuple[str, ...]:
    known = keys_at(tagged, model)
    if given is None and key[:1].isdigit():  # {wheel_separation: 0,285}
        return ("within braces a comma ends a value; write a decimal point, not a comma",)
    before, colon, behind = key.partition(":")
    if given is None and colon and before in known:  # {serial:FTDI1234}
        return (f"write a blank behind the colon: {before}: {legible(behind).strip()}",)
    if not known and tagged[0] == "links" and (elsewhere := kinds_with(key)):
        return (f"`{key}` belongs to links of kind {' and '.join(elsewhere)}",)
    if place := place_of(tagged):
        return (place,)
    if key.lower() in FOREIGN:
        return (_MASTER_URI,)
    meant = guess(key, known)
    holders = [one for one in known if key in known_keys((*tagged[:-1], one), model)]
    if not meant.words and holders:
        return (f"`{key}` belongs under {' or '.join(f'`{one}`' for one in holders)}",)
    if not meant.words and len(tagged) > 2 and key in known_keys(tuple(tagged[:-2]), model):
        return (f"`{key}` belongs beside `{tagged[-2]}`",)
    return suggestion(meant, known, "the keys here are")


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
    last = named[-1]
    return f"`{last}`" if isinstance(last, str) else f"entry {last + 1} of {_subject(named[:-1])}"


def _shown(given: Any) -> str:
    if given is None:
        return "empty"
    if isinstance(given, bool):
        return "`true`" if given else "`false`"
    if isinstance(given, dict):
        return "a mapping"
    if isinstance(given, tuple):
        return "a list"
    text = legible(str(given))
    return f"`{_short(text)}`" if text == text.strip() != "" else f'`"{_short(text)}"`'


def _short(text: str) -> str:
    return text if len(text) <= 60 else text[:57] + "..."


def _help_for_type(
    kind: str, given: Any, loc: tuple[str | int, ...], model: type[BaseModel]
) -> tuple[str, ...]:
    if kind == "string_type" and accepts(loc, model, given):
        return ("put it in quotes to make it text",)
    if kind in NUMBERS and is_number(given):
        return ("remove the quotes to make it a number",)
    if kind in NUMBERS and (simple := _plain_number(given)):
        return (simple,)
    if kind == "bool_type" and str(given).lower() in BOOLEANS:
        return (f"write `{BOOLEANS[str(given).lower()]}`",)
    if _TYPES[kind] == "a list" and (items := _items_in(given)):
        return (items,)
    if kind == "dict_type" and isinstance(given, tuple):
        return ("write each entry under its name: `NAME:` in place of `-`",)
    if kind == "model_type" and (key := only_key(loc, model, given)):
        return (f"write {{{key}: {given}}}",)
    if kind == "model_attributes_type":  # an entry of a union, text apart by its kind
        return (f"it begins with `kind`, one of {', '.join(kinds_at(loc))}",)
    if kind == "string_type" and loc[:1] == ("hosts",) and "bluetooth" in loc:
        return (words_of(ADAPTER),)
    text = described(loc, model) if loc else ""
    keys = ", ".join(f"`{key}`" for key in known_keys(loc, model)) if _TYPES[kind] == "a mapping" else ""
    return tuple(filter(None, (text and f"`{loc[-1]}`: {text}", keys and f"its keys are {keys}")))


def _plain_number(given: Any) -> str:
    """Help about a number that is written in an odd way; empty for anything else."""
    if is_too_long(given):
        return "no number here has so many digits"
    return f"write {given:.0f}" if isinstance(given, float) and given.is_integer() else ""


def _items_in(given: Any) -> str:
    """Help about a list that is written without its brackets, or in others; empty for anything else."""
    if is_list_in_braces(given):
        return f"write square brackets: [{_short(', '.join(given))}]"
    if not isinstance(given, str):
        return ""
    words = given.split()
    if len(words) > 1 and all(_PLAIN_WORD.fullmatch(one) for one in words):  # rosbag record -a
        return f"put it in brackets: [{_short(', '.join(words))}]"
    text = _short(legible(given).strip("()"))
    return f'put it in brackets: ["{text}"]' if text.startswith(_SIGNS) else f"put it in brackets: [{text}]"


def _help_for_choice(given: Any, choices: list[str]) -> tuple[str, ...]:
    if str(given) in choices:
        return (f"write {given} without quotes",)
    if meant := unescaped(given, choices):
        return (f"write {json.dumps(meant)} in double quotes: others keep the backslash as a character",)
    if not all(word.isprintable() for word in choices):
        return (f"it is one of {', '.join(map(json.dumps, choices))}, in double quotes",)
    return (
        (f"it can only be `{choices[0]}`",)
        if len(choices) == 1
        else did_you_mean(str(given), choices, "it is one of")
    )


def _pattern_help(pattern: str, given: str) -> str:
    name = legal_name(given) if pattern == NAME else None
    allowed = words_of(pattern)
    letter = look_alike(given)
    foreign = f"; `{letter}` is {named(letter)}" if letter else ""
    return f"write it `{name}`: {allowed}{foreign}" if name else allowed + foreign
