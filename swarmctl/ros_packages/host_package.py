"""A ROS package on a host, as far as it was read there."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterable, Mapping

from swarmctl.ros_packages.package import Package

_PLAIN = re.compile(r"[^\x00-\x1f\x7f-\x9f]{1,300}")


def on_host(
    host: str,
    name: str,
    folder: str | None,
    *,
    sought: Iterable[str],
    has: Iterable[str],
    texts: Mapping[str, str],
    listed: Iterable[str] = (),
    before: Package | None = None,
) -> Package:
    """Returns a package of ``host`` from what the host answered; ``before`` is what was known of it earlier.

    ``sought``: the paths that were looked for, ``has``: those that exist, with the ``texts`` of launch files;
    ``listed``: further launch files. Its folder is empty if the host lacks the package.
    """
    looked_for = frozenset(sought)
    files = dict.fromkeys(
        (*(one for one in listed if _PLAIN.fullmatch(one)), *looked_for.intersection(has)), False
    )
    contents = {path: text.encode() for path, text in texts.items() if path in files}
    if before is not None:
        files, contents = {**before.files, **files}, {**before.contents, **contents}
        looked_for |= before.sought or frozenset()
    shown = f"{host}:{posixpath.normpath(folder)}" if folder and _PLAIN.fullmatch(folder) else ""
    return Package(name, shown, frozenset(), files, contents, sought=looked_for)
