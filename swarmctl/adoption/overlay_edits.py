"""Writes a value of a spec into a file that is laid over it. Pure."""

from __future__ import annotations

from typing import Any

from swarmctl.yamltext import edits
from swarmctl.yamltext.emit import literal
from swarmctl.yamltext.source import Loc, Source, parse

#: What identifies the entries of a list in an overlay (see `yamltext.overlay`).
_NAMES = {"links": ("robot", "name"), "control": ("by",)}


def overlaid(text: str, spec: Source, loc: Loc, value: Any) -> str:
    """Returns the text of an overlay with ``value`` at ``loc`` of ``spec``.

    Empty where an overlay cannot say it.
    """
    names = _NAMES.get(str(loc[0]), ())
    rest = loc[2:] if names else loc[1:]
    if any(isinstance(one, int) for one in rest):
        return ""  # lists are replaced as a whole
    if not names:
        return _put(text, loc, value)
    entry = spec.data[loc[0]][loc[1]]
    identity = next(((name, entry[name]) for name in names if isinstance(entry.get(name), str)), None)
    if identity is None or not rest:
        return ""
    overlay, _ = parse(text, "")
    entries = (overlay.data or {}).get(loc[0], ())
    there = next((n for n, one in enumerate(entries) if one.get(identity[0]) == identity[1]), None)
    if there is not None:
        return _put(text, (loc[0], there, *rest), value)
    for key in reversed(rest):
        value = {key: value}
    item = {identity[0]: identity[1], **value}
    if not entries:
        return _put(text, (loc[0],), [item])
    return _applied(text, edits.append_item(overlay, (loc[0],), item))


def _put(text: str, loc: Loc, value: Any) -> str:
    overlay, _ = parse(text, "")
    if overlay.data:
        return _applied(text, edits.put(overlay, loc, value))
    for key in reversed(loc[1:]):
        value = {key: value}
    lines = [f"  {key}: {literal(one)}" for key, one in value.items()] if isinstance(value, dict) else []
    lines = lines or [f"  - {literal(one)}" for one in value]
    return "\n".join([f"{text.rstrip()}\n{loc[0]}:" if text.strip() else f"{loc[0]}:", *lines, ""])


def _applied(text: str, made: edits.Edits) -> str:
    return edits.apply(text, made) if made else ""
