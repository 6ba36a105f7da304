"""``json`` without its modules in Python: they load ``re``, which takes a tenth of the agent's start.

What they call, the compiled module ``_json``, is part of CPython 3.8 to 3.14; without it, ``json`` does it.
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

_WHITE = " \t\n\r"  # RFC 8259 §2


class _Defaults:
    """The attributes of ``json.JSONDecoder`` that ``make_scanner`` reads."""

    strict = True
    object_hook = object_pairs_hook = None
    parse_float = float
    parse_int = int
    parse_constant = {"NaN": float("nan"), "Infinity": float("inf"), "-Infinity": -float("inf")}.__getitem__


try:
    from _json import encode_basestring_ascii, make_encoder, make_scanner
except ImportError:
    import json

    def loads(text: str) -> Any:
        """Returns the value of a JSON text. Raises ``ValueError``."""
        return json.loads(text)

    def dumps(value: Any, *, sort_keys: bool = False) -> str:
        """Returns ``value`` as JSON in ASCII, without spaces. Raises ``TypeError``, ``ValueError``."""
        return json.dumps(value, sort_keys=sort_keys, separators=(",", ":"))

else:
    _scan = make_scanner(_Defaults())  # type: ignore[arg-type]

    def loads(text: str) -> Any:
        """Returns the value of a JSON text. Raises ``ValueError``."""
        stripped = text.strip(_WHITE)
        try:
            value, end = _scan(stripped, 0)
            if end == len(stripped):
                return value
        except (StopIteration, ValueError, SystemError):  # the last where nothing has loaded `json`
            pass
        import json  # noqa: PLC0415  (takes long to load, and only its error is needed)

        return json.loads(text)

    def dumps(value: Any, *, sort_keys: bool = False) -> str:
        """Returns ``value`` as JSON in ASCII, without spaces. Raises ``TypeError``, ``ValueError``."""
        encode = make_encoder({}, _refuse, encode_basestring_ascii, None, ":", ",", sort_keys, False, True)
        return "".join(encode(value, 0))

    def _refuse(value: object) -> object:
        raise TypeError(f"a {type(value).__name__} has no form in JSON")
