"""Under which conditions a deploy goes on, and what it may replace. Values."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

from swarmctl.deploy.host_transaction import Terms
from swarmctl.remote.transport import HostError


@dataclass(frozen=True)
class Rules:
    """``most_failed``: hosts that may fail before the others are held back, None for any number;
    ``optional``: hosts that do not count; ``terms``: what a change must show before it stays;
    ``stop_robots``: robots that move or are under command are stopped, where a change would touch them;
    ``overwrite_edits``: what people have edited on a host may be replaced;
    ``wait``: s that the survey waits for robots that must not be touched now."""

    most_failed: int | None = 0
    optional: Collection[str] = ()
    terms: Terms = field(default_factory=Terms)
    stop_robots: bool = False
    wait: float = 0.0
    overwrite_edits: bool = False

    def holds(self, errors: Mapping[str, HostError]) -> bool:
        """Returns True if so many hosts have failed that the others are held back."""
        return self.most_failed is not None and len(self.counted(errors)) > self.most_failed

    def counted(self, errors: Mapping[str, HostError]) -> dict[str, HostError]:
        """Returns the errors of the hosts that count."""
        return {host: error for host, error in errors.items() if host not in self.optional}
