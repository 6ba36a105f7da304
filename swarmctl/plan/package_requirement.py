"""Something that a host needs, the Debian packages that bring it, and the entries of the spec behind it."""

from __future__ import annotations

from dataclasses import dataclass

Entries = tuple[str, ...]
"""The entries of the spec that need something, such as ``robots.k3``."""


@dataclass(frozen=True)
class PackageRequirement:
    """Something that one of the Debian ``packages`` brings; without ``requirement`` the package itself.

    ``key``: the rosdep key of a package.xml that it is; the first of ``packages`` that apt knows counts then.
    """

    requirement: str
    packages: tuple[str, ...]
    entries: Entries
    key: str = ""
