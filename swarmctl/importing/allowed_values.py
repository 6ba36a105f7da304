"""What may stand in a spec: values of each key, names made of others, and never a secret."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from typing import Any

from pydantic import TypeAdapter, ValidationError

from swarmctl.field_types import (
    Account,
    Address,
    Baud,
    DevicePath,
    EnvironmentKey,
    FileName,
    GraphName,
    Mac,
    Namespace,
    PackageName,
    Port,
    Printable,
    Value,
)
from swarmctl.importing.draft import Fact
from swarmctl.ros_packages.launched import Place
from swarmctl.swarm.names import TAKEN

_LONGEST_NAME = 31
_KINDS: Mapping[str, TypeAdapter[Any]] = {
    "address": TypeAdapter(Address),
    "user": TypeAdapter(Account),
    "port": TypeAdapter(Port),
    "package": TypeAdapter(PackageName),
    "executable": TypeAdapter(FileName),
    "graph name": TypeAdapter(GraphName),
    "namespace": TypeAdapter(Namespace),
    "parameter": TypeAdapter(Value),
    "variable": TypeAdapter(EnvironmentKey),
    "text": TypeAdapter(Printable),
    "mac": TypeAdapter(Mac),
    "device": TypeAdapter(DevicePath),
    "baud": TypeAdapter(Baud),
}
_SECRET = re.compile(
    r"(?<!com)(?<!by)pass(?![a-z])|passwd|password|passphrase|pwd|secret|token|credential|vault|psk"
    r"|(?<![a-z])(key|pin|auth)(?![a-z])|(api|access|private|auth)_?key|(?-i:[a-z]Key)",
    re.I,
)
_KEY_FILES = ("ansible_ssh_private_key_file", "ansible_private_key_file")
_IN_ADDRESS = re.compile(r"//[^/\s@]*:[^/\s@]*@")  # account:password@host


def is_allowed(kind: str, value: Any) -> bool:
    """Returns True if the spec takes ``value`` for a key of this ``kind``."""
    try:
        _KINDS[kind].validate_python(value, strict=True)
    except ValidationError:
        return False
    return True


def is_secret(key: str, value: str = "") -> bool:
    """Returns True if a variable of this name, or with this value, may hold a secret."""
    if key in _KEY_FILES:
        return False
    return bool(_SECRET.search(key) or _IN_ADDRESS.search(value) or "PRIVATE KEY-----" in value)


def number(text: str) -> int | str:
    """Returns a decimal number, or the text if it is none."""
    return int(text) if re.fullmatch("[0-9]{1,9}", text, re.ASCII) else text


def name_fact(text: str, prefix: str, place: Place | None, taken: Collection[str], guess: str = "") -> Fact:
    """Returns a name of the spec for what a file calls ``text``; one that is ``taken`` gets a number."""
    name = valid_name(text, prefix)
    found, count = name, 1
    while found in taken:
        count += 1
        found = f"{name[: _LONGEST_NAME - len(str(count)) - 1]}-{count}"
    return Fact(found, place, guess, was=text if found != text else "")


def valid_name(text: str, prefix: str) -> str:
    """Returns text as a name of the spec: lower case, hyphens; ``prefix`` before what is not a letter."""
    name = re.sub("[^a-z0-9]+", "-", text.lower()).strip("-")
    is_reserved = name == "localhost" if prefix == "host" else name in TAKEN
    if not name[:1].isalpha() or is_reserved:
        name = f"{prefix}-{name}"
    return name[:_LONGEST_NAME].rstrip("-")
