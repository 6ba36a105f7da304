"""Templates of programs' files, rendered for a host in Jinja's sandbox. Pure."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from types import TracebackType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import jinja2

_NAME = "template"
_MAX_CHARACTERS = 4 << 20
_QUOTED = re.compile(r"'([^']+)'")


class TemplateError(ValueError):
    """A template that cannot be rendered. ``line`` and ``column`` count from 1."""

    def __init__(self, message: str, line: int, column: int) -> None:
        super().__init__(message)
        self.line = line
        self.column = column


def rendered(content: bytes, values: Mapping[str, object]) -> bytes:
    """Returns a template's text with ``values``; a value that is not defined is an error.

    Raises TemplateError.
    """
    from jinja2 import TemplateSyntaxError  # noqa: PLC0415  (most specs have no templates)

    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise TemplateError(f"the byte 0x{content[error.start]:02X} is not valid UTF-8", line, 1) from None
    try:
        template = _environment().from_string(text)
        return _limited(template, values).encode()
    except TemplateSyntaxError as error:
        message = error.message or "it is not a template"
        raise TemplateError(message, error.lineno, _column(text, error.lineno, message)) from None
    except TemplateError:
        raise
    except Exception as error:  # noqa: BLE001  (an expression of the user's may raise anything)
        line, message = _line(error.__traceback__), str(error) or type(error).__name__
        raise TemplateError(message, line, _column(text, line, message)) from None


def _limited(template: jinja2.Template, values: Mapping[str, object]) -> str:
    parts: list[str] = []
    size = 0
    for part in template.generate(values):
        size += len(part)
        if size > _MAX_CHARACTERS:
            raise TemplateError(f"it makes more than {_MAX_CHARACTERS >> 20} MiB", 1, 1)
        parts.append(part)
    return "".join(parts)


def _line(traceback: TracebackType | None) -> int:
    """The innermost line of the template; Jinja rewrites the traceback to have its lines."""
    line = 1
    while traceback is not None:
        if traceback.tb_frame.f_code.co_filename in (f"<{_NAME}>", "<unknown>"):
            line = traceback.tb_lineno
        traceback = traceback.tb_next
    return line


def _column(text: str, line: int, message: str) -> int:
    """Where the line has what the message names; else where its text begins."""
    lines = text.splitlines() or [""]
    written = lines[min(line, len(lines)) - 1]
    for word in _QUOTED.findall(message):
        if found := re.search(rf"\b{re.escape(word)}\b", written):
            return found.start() + 1
    return len(written) - len(written.lstrip()) + 1


@cache
def _environment() -> jinja2.Environment:
    from jinja2 import StrictUndefined  # noqa: PLC0415  (most specs have no templates)
    from jinja2.sandbox import ImmutableSandboxedEnvironment  # noqa: PLC0415

    return ImmutableSandboxedEnvironment(
        undefined=StrictUndefined, keep_trailing_newline=True, trim_blocks=True, lstrip_blocks=True
    )
