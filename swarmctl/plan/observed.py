"""What a host said about itself: the release it runs, and how far its files and units are from it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, cast

from swarmctl.render.bundle import Bundle


@dataclass(frozen=True)
class UnitState:
    """A systemd unit as ``systemctl show`` tells it. ``skipped``: a condition of the unit is not met."""

    active: str
    sub: str = ""
    pid: int = 0
    restarts: int = 0
    skipped: bool = False

    @property
    def runs(self) -> bool:
        return self.active in ("active", "activating", "reloading")


@dataclass(frozen=True)
class Observed:
    """One host before a change. ``manifest`` is that of the release it runs, as ``Bundle.manifest`` wrote it.

    ``drift``, ``links`` and ``blocks`` say how the host differs from that manifest:
    by path ``changed``, ``missing``, ``extra`` or ``damaged``.
    ``secrets`` says by name how what it keeps compares with the operator's: ``same``, ``other`` or ``new``;
    where he has none ``kept`` or ``missing``.
    """

    digest: str | None = None
    manifest: Mapping[str, Any] = field(default_factory=dict)
    drift: Mapping[str, str] = field(default_factory=dict)
    links: Mapping[str, str] = field(default_factory=dict)
    blocks: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, UnitState] = field(default_factory=dict)
    contents: Mapping[str, str] = field(default_factory=dict)
    unfinished: str = ""
    secrets: Mapping[str, str] = field(default_factory=dict)
    facts: Mapping[str, Any] = field(default_factory=dict)

    @property
    def files(self) -> Mapping[str, Mapping[str, Any]]:
        return cast(Mapping[str, Mapping[str, Any]], self.manifest.get("files", {}))

    @property
    def unit_digests(self) -> Mapping[str, str]:
        return {unit["name"]: unit["digest"] for unit in self.manifest.get("units", ())}

    def takes(self, path: str) -> bool:
        """Whether the host has the program, if any, to which the place of ``path`` belongs."""
        absent: Sequence[str] = self.facts.get("absent", ())
        return not any(path == place or path.startswith(f"{place}/") for place in absent)


NOTHING = Observed()


def from_answer(answer: Mapping[str, Any], bundle: Bundle) -> Observed:
    """The agent's answer to ``observe``. It leaves the manifest out when the host runs ``bundle`` already."""
    digest = answer["release"]
    drift = answer["drift"]
    return Observed(
        digest=digest,
        manifest=bundle.manifest if digest == bundle.digest else answer.get("manifest", {}),
        drift=drift["files"],
        links=drift["links"],
        blocks=drift["blocks"],
        units={name: _unit(state) for name, state in answer["units"].items()},
        contents=answer.get("files", {}),
        unfinished=_unfinished(answer.get("transaction", {})),
        secrets=answer.get("secrets", {}),
        facts=answer["facts"],
    )


def _unit(state: Mapping[str, Any]) -> UnitState:
    return UnitState(
        active=state["active"],
        sub=state["sub"],
        pid=state["pid"],
        restarts=state["restarts"],
        skipped=bool(state.get("skipped")),
    )


def _unfinished(record: Mapping[str, Any]) -> str:
    """The change that a dead connection or a power cut left half done, if there is one."""
    if record.get("state") != "applying":
        return ""
    return f"{record.get('prev') or 'nothing'} -> {record.get('next')} by {record.get('who') or 'someone'}"
