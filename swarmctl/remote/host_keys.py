"""Public keys of SSH hosts as OpenSSH writes them."""

from __future__ import annotations

import base64
import hashlib
import struct


class BadKeyError(ValueError):
    """A text is not a public key."""


def parse_key(text: str) -> tuple[str, bytes]:
    """Type and raw bytes of a public key line such as ``ssh-ed25519 AAAA...`` (a comment may follow).

    Raises ``BadKeyError``.
    """
    words = text.split()
    if len(words) < 2:
        raise BadKeyError("a key is its type, a space and its base64 text")
    try:
        raw = base64.b64decode(words[1], validate=True)
    except ValueError:
        raise BadKeyError(f"the text after {words[0]} is not base64") from None
    if len(raw) < 4 or raw[4 : 4 + struct.unpack(">I", raw[:4])[0]] != words[0].encode(errors="replace"):
        raise BadKeyError(f"the text after {words[0]} is not a key of that type")
    return words[0], raw


def fingerprint(key: str) -> str:
    """The key's fingerprint as ``ssh-keygen -l`` prints it: ``SHA256:`` and unpadded base64."""
    _, raw = parse_key(key)
    return "SHA256:" + base64.b64encode(hashlib.sha256(raw).digest()).decode().rstrip("=")
