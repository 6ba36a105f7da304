"""The variables in a file of a release that systemd reads (``EnvironmentFile``, systemd.exec(5))."""

from __future__ import annotations

import re

ROS = "env/ros.env"
_ESCAPED = re.compile(r"\\(.)")


def variables_in(text: str) -> dict[str, str]:
    """Returns the variables by name; a value may stand in double quotes."""
    lines = (line.strip() for line in text.splitlines())
    pairs = (line.partition("=") for line in lines if line and not line.startswith("#"))
    return {name: _unquoted(value) for name, _, value in pairs}


def _unquoted(value: str) -> str:
    quoted = len(value) > 1 and value[0] == value[-1] == '"'
    return _ESCAPED.sub(r"\1", value[1:-1]) if quoted else value
