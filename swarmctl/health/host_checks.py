"""The checks of a host itself, which are modules of ``swarm_onboard.host_checks``. Pure."""

from __future__ import annotations

import importlib
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any, Protocol, cast

from swarm_onboard.agent.release_store import Home
from swarm_onboard.host_checks import Judged

from swarmctl.resources import host_check_names


class HostCheck(Protocol):
    """A module of ``swarm_onboard.host_checks``."""

    TABLE: Sequence[tuple[str, str]]
    Seen: type

    def observe(self, home: Home) -> list[Any]:
        """Returns what the host has, as values of the type ``Seen``."""
        ...

    def judge(self, seen: Any, host: str) -> Judged:
        """Returns the verdict on one of them."""
        ...


@cache
def host_checks() -> Mapping[str, HostCheck]:
    """Returns the checks by name."""
    return {
        name: cast(HostCheck, importlib.import_module(f"swarm_onboard.host_checks.{name}"))
        for name in host_check_names()
    }
