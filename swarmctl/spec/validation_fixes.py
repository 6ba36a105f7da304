"""What was meant by a key or value that does not fit its model, where that can be worked out, as a fix."""

from __future__ import annotations

import ast
import ipaddress
import json
import re
import unicodedata
from collections.abc import Callable
from typing import Any

from pydantic import BaseModel

from swarmctl.diagnostics import Fix
from swarmctl.field_types import MESSAGE_TYPE, NAME, NAMESPACE, ROBOT_TYPE_NAME
from swarmctl.plugins import LINK_KINDS, Registry
from swarmctl.robot_types.protocols import PROTOCOLS
from swarmctl.robot_types.sensors import SENSORS
from swarmctl.spec.model_lookup import FORMS, accepts, is_model, known_keys, link_keys, place_of, types_at
from swarmctl.spec.references import rename_at, renaming
from swarmctl.suggest import Guess, guess
from swarmctl.units import UnitError
from swarmctl.yamltext.edits import as_text, make_fix, rename_key, replace_value, written
from swarmctl.yamltext.scalars import number_or_text
from swarmctl.yamltext.source import Loc, Source

_CURLY = "\u2018-\u201f\u00ab\u00bb\u2039\u203a"
# The value within, and how to write it.
_FORMS = (
    (re.compile(f"[{_CURLY}](?P<value>[^{_CURLY}]+)[{_CURLY}]"), "YAML knows straight quotes only: write {}"),
    (
        re.compile(r"(?P<value>.*[^,;\s])\s*[,;]"),
        "a line of YAML ends without a comma or semicolon: write {}",
    ),
    (
        re.compile(r"(?P<value>[^\s#/]+)\s*(?:#|//).*"),
        "a comment begins with a blank and `#`: write {} # ...",
    ),
)


def value_within(text: str, fits: Callable[[str], bool]) -> tuple[str, str] | None:
    """Returns the value that ``fits`` within ``text``, and help; None if ``text`` has no such characters."""
    for form, help_ in _FORMS:
        found = form.fullmatch(text)
        if found is not None and fits(found["value"]):
            return found["value"], help_.format(found["value"])
    return None


NUMBERS = ("int_type", "float_type")
BOOLEANS = {
    "yes": "true", "on": "true", "y": "true", "true": "true", "enabled": "true", "1": "true",
    "no": "false", "off": "false", "n": "false", "false": "false", "disabled": "false", "0": "false",
}  # fmt: skip
Kinds = tuple[str, ...] | Registry
# Places whose `kind` chooses what they hold: the steps to them (None is any name), the kinds, the noun.
_UNIONS: tuple[tuple[tuple[str | None, ...], Kinds, str], ...] = (
    (("links", None), LINK_KINDS, "link"),
    (("protocol",), tuple(PROTOCOLS), "protocol"),
    (("types", None, "protocol"), tuple(PROTOCOLS), "protocol"),
    (("sensors", None), tuple(SENSORS), "sensor"),
    (("types", None, "sensors", None), tuple(SENSORS), "sensor"),
)
_CHOICE = re.compile(r"'(?:[^'\\]|\\.)*'|[-+]?[0-9]+")  # as pydantic lists them: 'a', 'b' or 1
_UMLAUTS = str.maketrans({"ä": "ae", "ö": "oe", "ü": "ue", "ß": "ss"})
#: Letters of Cyrillic and Greek that look like Latin ones (confusables.txt of Unicode).
_LOOK_ALIKES = str.maketrans(
    "асԁеһіјӏорԛѕԝхуАВЕЅІЈКМНОРСТУХαγικνορυχΑΒΕΖΗΙΚΜΝΟΡΤΥΧ",
    "acdehijlopqswxyABESIJKMHOPCTYXayikvopuxABEZHIKMNOPTYX",
)
_LETTERS = re.compile("[a-z0-9]+", re.ASCII)
_ONE_WORD = re.compile("@?[A-Za-z0-9_./:~-]+", re.ASCII)  # `@lab` is a group
_RESPELT = re.compile("[A-Za-z0-9_. -]+", re.ASCII)
_CAPITAL = re.compile("(?<=[a-z0-9])(?=[A-Z])")  # that begins a word, as in `ArduinoRover`
_DIGITS = re.compile("[-+]?[0-9]+", re.ASCII)
_NUMBER = re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?", re.ASCII)
# A message type as ROS 2, Python, C++ and file names write it.
_OTHER_TYPE = re.compile(
    r"(?P<package>[A-Za-z]\w*)(?:[/.]|::)(?:msg(?:[/.]|::))?(?P<message>[A-Za-z]\w*?)(?:\.msg)?", re.ASCII
)
_MAC = re.compile("[0-9a-fA-F]{2}([-_. :]?[0-9a-fA-F]{2}){5}", re.ASCII)


def _message_type(given: str) -> str:
    """Returns a message type of ROS 1 as meant; empty if that is unknown."""
    other = _OTHER_TYPE.fullmatch(given.strip())
    return f"{other['package']}/{other['message']}" if other else ""


def _namespace(given: str) -> str:
    """Returns a namespace without outer slashes and hyphens; empty if something else is wrong."""
    space = given.strip("/").replace("-", "_")
    return space if re.fullmatch(NAMESPACE, space) else ""


def _robot_type(given: str) -> str:
    """Returns the name of a robot type as files have it; empty if there is none: `arduino-rover`."""
    name = re.sub("[ _-]+", "-", _CAPITAL.sub("-", given.strip())).lower()
    return name if re.fullmatch(ROBOT_TYPE_NAME, name) else ""


_RESPELLED = {MESSAGE_TYPE: _message_type, NAMESPACE: _namespace, ROBOT_TYPE_NAME: _robot_type}


def fix_for(error: Any, source: Source, model: type[BaseModel]) -> Fix | None:
    """Returns the fix of one of pydantic's errors, if there is one."""
    kind, tagged, given = error["type"], tuple(error["loc"]), error.get("input")
    loc = without_tag(tagged)
    if not loc:
        return None
    if kind == "extra_forbidden":
        meant = guess(str(loc[-1]), keys_at(tagged, model))
        takes_keys = meant.only is not None and known_keys((*tagged[:-1], meant.only), model)
        elsewhere = place_of(tagged) or (takes_keys and not isinstance(given, dict))
        return None if elsewhere else _key_fix(source, loc, meant)
    if kind == "union_tag_invalid":
        return _word_fix(source, (*loc, "kind"), guess(str(given.get("kind")), kinds_at(loc)))
    if kind in ("literal_error", "enum"):
        return _choice_fix(source, loc, given, choices(error))
    if kind == "string_pattern_mismatch" and error["ctx"]["pattern"] == NAME:
        name = None if names_run_together(source, loc, given) else legal_name(given)
        return (
            renaming(given, name, rename_at(source, loc, given, name), safe=_is_respelt(given))
            if name
            else None
        )
    if kind == "string_pattern_mismatch" and error["ctx"]["pattern"] in _RESPELLED:
        respelled = _RESPELLED[error["ctx"]["pattern"]](given)
        change = f"write `{respelled}`"
        return make_fix(change, replace_value(source, loc, respelled), safe=True) if respelled else None
    if kind == "value_error" and isinstance(raised := error["ctx"]["error"], UnitError) and raised.meant:
        return make_fix(
            f"write `{raised.meant}`", replace_value(source, loc, number_or_text(raised.meant)), safe=True
        )
    if kind == "model_type" and (key := only_key(tagged, model, given)):
        return make_fix(f"write {{{key}: {given}}}", replace_value(source, loc, {key: given}), safe=False)
    if kind == "string_type" and not accepts(tagged, model, written(source, loc)) and loc[-1] != "mac":
        return None
    return _value_fix(kind, source, loc, given)


def only_key(tagged: Loc, model: type[BaseModel], given: Any) -> str:
    """Returns the key of the only value that a mapping needs, if ``given`` may be that value, or nothing."""
    fields = {
        name: one
        for place in types_at(tuple(tagged), model)
        if is_model(place)
        for name, one in place.model_fields.items()
    }
    needed = [name for name, one in fields.items() if one.is_required()]
    needed += [place.lone_key for place in types_at(tuple(tagged), model) if hasattr(place, "lone_key")]
    known = len(needed) == 1 and len(fields) > 1 and isinstance(given, str)
    return needed[0] if known and accepts((*tagged, needed[0]), model, given) else ""


def _key_fix(source: Source, loc: Loc, meant: Guess) -> Fix | None:
    beside = source.data
    for step in loc[:-1]:
        beside = beside[step]
    if meant.only is None or (meant.only in beside and _in_one_file(source, loc, (*loc[:-1], meant.only))):
        return None
    return make_fix(
        f"rename the key to `{meant.only}`", rename_key(source, loc, meant.only), safe=meant.certain
    )


def _in_one_file(source: Source, *keys: Loc) -> bool:
    """False for keys of which one is in a file laid over the other's, and replaces what that has."""
    return len({source.span(loc, key=True).file for loc in keys}) == 1


def _word_fix(source: Source, loc: Loc, meant: Guess) -> Fix | None:
    word = meant.only
    return make_fix(f"write `{word}`", replace_value(source, loc, word), safe=meant.certain) if word else None


def _choice_fix(source: Source, loc: Loc, given: Any, known: list[str]) -> Fix | None:
    if meant := unescaped(given, known):
        return make_fix(f"write {json.dumps(meant)}", replace_value(source, loc, meant), safe=True)
    if str(given) not in known:
        return _word_fix(source, loc, guess(str(given), tuple(known)))
    if is_number(given) and _DIGITS.fullmatch(given):
        return make_fix("remove the quotes", replace_value(source, loc, int(given)), safe=True)
    return None


def _value_fix(kind: str, source: Source, loc: Loc, given: Any) -> Fix | None:
    """The fix of a value of the wrong type or form; of a number, the letters count, as the text has them."""
    number = isinstance(given, (int, float)) and not isinstance(given, bool)
    if loc[-1] == "mac" and (isinstance(given, str) or number):
        address = _mac(written(source, loc))
        return (
            make_fix(f'write "{address}"', replace_value(source, loc, address), safe=True)
            if address
            else None
        )
    if kind == "string_type" and number:
        return make_fix("put it in quotes", as_text(source, loc), safe=True)
    if kind in NUMBERS and is_number(given) and (kind == "float_type" or _DIGITS.fullmatch(given)):
        meant = int(given) if _DIGITS.fullmatch(given) else float(given)
        return make_fix("remove the quotes", replace_value(source, loc, meant), safe=True)
    if kind == "bool_type" and (word := BOOLEANS.get(str(given).lower())):
        return make_fix(f"write `{word}`", replace_value(source, loc, word == "true"), safe=True)
    if kind in ("int_from_float", "int_type") and isinstance(given, float) and given.is_integer():
        return make_fix(f"write {given:.0f}", replace_value(source, loc, int(given)), safe=True)
    if kind in ("tuple_type", "list_type") and is_list_in_braces(given):
        return make_fix("write square brackets", replace_value(source, loc, list(given)), safe=True)
    if kind in ("tuple_type", "list_type") and isinstance(given, str) and _ONE_WORD.fullmatch(given):
        # `hosts` or `robots` of a program may be meant to be `host` or `robot`: a list makes other names
        safe = loc[0] != "programs" or loc[-1] not in ("hosts", "robots")
        return make_fix("put it in brackets", replace_value(source, loc, [given]), safe=safe)
    if kind == "value_error" and loc[-1] == "subnet" and (subnet := _subnet(given)):
        # the prefix length may be the wrong part
        return make_fix(f"write `{subnet}`", replace_value(source, loc, subnet), safe=False)
    return None


def without_tag(loc: Loc) -> tuple[str | int, ...]:
    """Returns the place as it is in the file, without pydantic's tag of a link, protocol or sensor."""
    loc = tuple(step for step in loc if step not in FORMS)
    steps, kinds, _ = _union_at(loc)
    tagged = len(loc) > steps > 0 and loc[steps] in kinds
    return (*loc[:steps], *loc[steps + 1 :]) if tagged else loc


def kinds_at(loc: Loc) -> tuple[str, ...]:
    """Returns the kinds that the value at ``loc`` can have."""
    return tuple(_union_at(loc)[1])


def noun_at(loc: Loc) -> str:
    """Returns the word for it: link, protocol or sensor."""
    return _union_at(loc)[2]


def _union_at(loc: Loc) -> tuple[int, Kinds, str]:
    """How many steps into ``loc`` a kind is chosen, which there are, and of what; no steps if none is."""
    for steps, kinds, noun in _UNIONS:
        if len(loc) >= len(steps) and all(
            step in (None, part) for step, part in zip(steps, loc, strict=False)
        ):
            return len(steps), kinds, noun
    return 0, (), ""


def keys_at(tagged: Loc, model: type[BaseModel]) -> tuple[str, ...]:
    """Returns the keys allowed at the place of an unknown key; none if other kinds of links have it."""
    place = without_tag(tagged)
    if tuple(tagged) == place or tagged[0] != "links" or len(place) != 3:
        return known_keys(tuple(tagged[:-1]), model)
    return () if kinds_with(str(place[-1])) else link_keys(str(tagged[2]))


def kinds_with(key: str) -> list[str]:
    """Returns the kinds of links that have a key."""
    return [kind for kind in LINK_KINDS if key in link_keys(kind)]


def choices(error: Any) -> list[str]:
    """Returns the words that a value can be."""
    return [str(ast.literal_eval(word)) for word in _CHOICE.findall(error["ctx"]["expected"])]


def unescaped(given: Any, known: list[str]) -> str | None:
    """Returns the control character among the choices whose escape ``given`` is: single quotes keep it."""
    return next((word for word in known if not word.isprintable() and json.dumps(word)[1:-1] == given), None)


def is_number(given: Any) -> bool:
    """Returns True if ``given`` is text that would be a number without its quotes."""
    return (
        isinstance(given, str)
        and _NUMBER.fullmatch(given) is not None
        and not isinstance(number_or_text(given), str)
    )


def is_list_in_braces(given: Any) -> bool:
    """Returns True for ``{a, b}``: keys without values."""
    return isinstance(given, dict) and len(given) > 0 and not any(one is not None for one in given.values())


def is_too_long(given: Any) -> bool:
    """Returns True if ``given`` is a whole number with too many digits."""
    return isinstance(given, str) and _DIGITS.fullmatch(given) is not None and not is_number(given)


def names_run_together(source: Source, loc: Loc, given: str) -> list[str]:
    """Returns the names of the spec that ``given``, an entry of a list, has without commas between them."""
    sections = [one for one in source.data.values() if isinstance(one, dict)]
    words = given.split()
    known = all(any(word in section for section in sections) for word in words)
    return words if known and len(words) > 1 and loc and isinstance(loc[-1], int) else []


def legal_name(given: str) -> str | None:
    """Returns the nearest name that a spec allows: ``k3-pi`` for ``K3_Pi``, ``kaefer`` for ``Käfer``."""
    latin = unicodedata.normalize("NFC", given).translate(_LOOK_ALIKES)
    plain = unicodedata.normalize("NFKD", latin.lower().translate(_UMLAUTS))
    plain = "".join(char for char in plain if not unicodedata.combining(char))
    name = "-".join(_LETTERS.findall(plain)) if given.isprintable() else ""
    return name if re.fullmatch(NAME, name, re.ASCII) else None


def look_alike(given: str) -> str | None:
    """Returns the first letter of another script that looks like a Latin one."""
    return next((char for char in given if ord(char) in _LOOK_ALIKES), None)


def _is_respelt(given: str) -> bool:
    """True if a legal name for it differs only in case and separators."""
    return _RESPELT.fullmatch(given) is not None


def _mac(text: str) -> str | None:
    """A Bluetooth address in the usual form, whatever stands between its pairs."""
    if not _MAC.fullmatch(text):
        return None
    digits = re.sub("[^0-9a-fA-F]", "", text)
    return ":".join(digits[at : at + 2] for at in range(0, 12, 2))


def _subnet(given: str) -> str | None:
    """The network of an address with a prefix length."""
    try:
        return str(ipaddress.ip_interface(given).network) if "/" in given else None
    except ValueError:
        return None
