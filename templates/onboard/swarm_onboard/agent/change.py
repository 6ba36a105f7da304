"""The requested change of a host from one release to the next."""

from __future__ import annotations

from .named_tuple import NamedTuple
from .steps import Step, targets


class Change(NamedTuple):
    """``previous`` is the release that the plan was made for; ``confirm_within``: s until
    it is undone without a confirmation, 0 if none is needed; ``values``: new ones of its secrets, by name, or
    ``secrets``: the kept set to go back to; ``stop_robots``: robots that move or are under command are
    stopped; without it the change is refused; ``files_only``: it is refused if it is more than files of the
    release that nothing uses by itself."""

    txid: str
    who: str
    run: str
    previous: str | None
    next: str
    steps: list[Step]
    confirm_within: float
    values: dict[str, bytes]
    secrets: str | None = None
    stop_robots: bool = False
    files_only: bool = False

    def targets(self, *kinds: str) -> list[str]:
        """Returns the targets of the steps of these kinds."""
        return targets(self.steps, *kinds)
