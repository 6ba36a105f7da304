"""A state of the host that is kept: what a rollback brings back."""

from __future__ import annotations

from .named_tuple import NamedTuple


class State(NamedTuple):
    """What a host can go back to: the digest of a release, and the name of a set of secrets or no text."""

    release: str
    secrets: str
