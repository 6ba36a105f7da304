"""Made-up versions 0, 1 and 2 of a spec format, with every kind of change from each to the next."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from swarmctl.migration.steps import renamed, rewritten
from swarmctl.migration.versions import Versions


def _metres(value: Any) -> Mapping[tuple[str, ...], Any]:
    if not isinstance(value, (int, float)):
        raise ValueError(f"`{value}` is no number of centimetres")
    return {("robots", "*", "wheelbase"): value / 100}


def _account(value: Any) -> Mapping[tuple[str, ...], Any]:
    user, sign, address = str(value).partition("@")
    if not sign:
        raise ValueError(f"`{value}` has no account in front of an `@`")
    return {("hosts", "*", "address"): address, ("hosts", "*", "user"): user}


FORMATS = Versions(
    2,
    {
        0: (renamed(("hosts", "*", "ip"), "address"), *rewritten(("robots", "*", "wheelbase"), _metres)),
        1: (
            *rewritten(("hosts", "*", "address"), _account),
            *rewritten(("hosts", "*", "port"), lambda port: {("hosts", "*", "ssh", "port"): port}),
            *rewritten(("leader",), lambda leader: {("roles", "leader"): leader}),
        ),
    },
)
