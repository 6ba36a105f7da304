"""NAME.wireguard beside a spec: the public WireGuard keys of its hosts, as `swarmctl trust` pins them.

A line has the name of a host and its key in base64, as `wg pubkey` prints it. Other lines stay as they are.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from swarmctl.spec.model import Spec

_LINE = re.compile(r"(?P<host>[a-z][a-z0-9-]*) +(?P<key>[A-Za-z0-9+/]{43}=)", re.ASCII)


def paths(spec: Spec) -> Iterator[str]:
    """Yields the file of a sealed swarm, from the folder of the spec."""
    if spec.security == "sealed":
        yield path(spec.name)


def path(swarm: str) -> str:
    """Returns the name of the file."""
    return f"{swarm}.wireguard"


def parse(content: bytes) -> Mapping[str, str]:
    """Returns the key of each host; the last of several counts."""
    found = map(_LINE.fullmatch, content.decode(errors="replace").splitlines())
    return {line["host"]: line["key"] for line in found if line}


def pinned(content: bytes, keys: Mapping[str, str]) -> bytes:
    """Returns the content with these keys in place of other ones of the same hosts."""
    others = [
        line
        for line in content.decode(errors="surrogateescape").splitlines()
        if not (found := _LINE.fullmatch(line)) or found["host"] not in keys
    ]
    lines = [*others, *(f"{host} {key}" for host, key in keys.items())]
    return "".join(f"{line}\n" for line in lines).encode(errors="surrogateescape")
