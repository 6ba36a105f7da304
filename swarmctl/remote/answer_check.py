"""JSON from a host: within bounds, and as a value of the type that it should have."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Iterable
from functools import lru_cache, partial
from itertools import islice
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from swarmctl.remote.transport import HostError, Kind

if TYPE_CHECKING:
    from pydantic import TypeAdapter

T = TypeVar("T")

DEEPEST = 32  # levels of lists and objects in one answer
_LONGEST_COMPLAINT = 300  # characters
_LARGEST = 1 << 63
_LONGEST_NUMBER = 40  # characters
_MOST = 20_000  # entries of one list or object


def parsed(text: str | bytes) -> Any:
    """Returns JSON from a host; a number too large to compute with is NaN, which fits nowhere.

    Raises ValueError if it is none, or not ``bounded``.
    """
    try:
        value = json.loads(text, parse_int=partial(_number, int), parse_float=partial(_number, float))
    except RecursionError as error:
        raise ValueError(str(error)) from None
    if not bounded(value):
        raise ValueError("too deep, or not UTF-8")
    return value


def _number(kind: Callable[[str], float], text: str) -> float:
    value = kind(text) if len(text) < _LONGEST_NUMBER else math.nan
    return value if abs(value) < _LARGEST else math.nan


def bounded(value: Any) -> bool:
    """Returns True if ``value`` is at most ``DEEPEST`` levels deep and all its texts are valid UTF-8."""
    level: list[Any] = [value]
    for _ in range(DEEPEST):
        if not all(_encodable(one) for one in level if isinstance(one, str)):
            return False
        level = [inner for one in level for inner in _inside(one)]
        if not level:
            return True
    return False


def _inside(value: Any) -> Iterable[Any]:
    if isinstance(value, dict):
        return (*value.keys(), *value.values())
    return value if isinstance(value, list) else ()


def _encodable(text: str) -> bool:
    try:
        text.encode()
    except UnicodeEncodeError:  # half a surrogate pair
        return False
    return True


def cut(value: Any, longest_text: int) -> Any:
    """Returns JSON with texts of at most ``longest_text`` characters, and without endless lists."""
    if isinstance(value, str):
        return value[:longest_text]
    if isinstance(value, list):
        return [cut(one, longest_text) for one in value[:_MOST]]
    if isinstance(value, dict):
        first = islice(value.items(), _MOST)
        return {name[:longest_text]: cut(one, longest_text) for name, one in first}
    return value


def of_note(text: str, kind: type[T], what: str) -> T:
    """Returns the value of a note, the JSON of a ``kind``. Raises ``HostError``."""
    try:
        found = parsed(text)
    except ValueError:
        raise HostError(Kind.PROTOCOL, f"{what} cannot be read") from None
    return checked(found, kind, what)


def checked(found: Any, kind: type[T], what: str) -> T:
    """Returns JSON from a host, called ``what``, as a ``kind``. Raises ``HostError`` if it is none."""
    from pydantic import ValidationError  # noqa: PLC0415  (takes long to load; `stop` sends its request first)

    try:
        value: T = _adapter(kind).validate_python(found, strict=True)  # type: ignore[arg-type]
        return value
    except ValidationError as error:
        first = error.errors(include_url=False, include_context=False, include_input=False)[0]
        place = ".".join(str(one)[:80] for one in first["loc"])
        problem = f"{place}: {first['msg']}" if place else first["msg"]
    raise HostError(
        Kind.PROTOCOL,
        f"{what} does not fit: {printable(problem.encode(errors='replace'))[:_LONGEST_COMPLAINT]}",
        "is it the right host, and its Python intact?",
    )


@lru_cache
def _adapter(kind: Any) -> TypeAdapter[Any]:
    from pydantic import TypeAdapter  # noqa: PLC0415
    from typing_extensions import is_typeddict  # noqa: PLC0415

    # Modules of the agent do not import `typing` on a host, where loading it takes long.
    for name, module in list(sys.modules.items()):
        if name.startswith("swarm_onboard."):
            vars(module).update({"Any": Any, "Literal": Literal} | vars(module))
    return TypeAdapter(kind, config=None if is_typeddict(kind) else {"allow_inf_nan": False})


def printable(text: bytes) -> str:
    """Returns text from a host, harmless on a terminal: control characters are escaped."""
    return "".join(
        char if char.isprintable() else char.encode("unicode_escape").decode()
        for char in text.decode("utf-8", "backslashreplace")
    )
