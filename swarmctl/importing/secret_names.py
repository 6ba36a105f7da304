"""What may be a secret, as far as a variable's name and value show it."""

from __future__ import annotations

import re

_SECRET = re.compile(
    r"(?<!com)(?<!by)pass(?![a-z])|passwd|password|passphrase|pwd|secret|token|credential|vault|psk"
    r"|(?<![a-z])(key|pin|auth)(?![a-z])|(api|access|private|auth)_?key|(?-i:[a-z]Key)",
    re.I,
)
_IN_ADDRESS = re.compile(r"//[^/\s@]*:[^/\s@]*@")  # account:password@host


def is_secret(name: str, value: str) -> bool:
    """Returns True if a variable of this name, or with this value, may hold a secret."""
    return bool(_SECRET.search(name) or _IN_ADDRESS.search(value) or "PRIVATE KEY-----" in value)
