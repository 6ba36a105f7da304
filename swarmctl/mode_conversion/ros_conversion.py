"""Rewrites the text of a spec for another ROS, and changes only what that ROS requires."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from swarmctl.mode_conversion.convert import Conversion
from swarmctl.mode_conversion.text_editor import Change, TextEditor, removed, replaced, set_to
from swarmctl.render.middleware import middleware_of
from swarmctl.spec.load import Document


def for_distro(document: Document, distro: str) -> Conversion:
    """Returns ``document`` for the ROS distribution ``distro``."""
    text = TextEditor(document.source)
    used = {"distro", *middleware_of(distro).settings}
    for change in (*_of_ros(document, distro, used), *_of_islands(document)):
        text.change(change)
    if "master_port" not in used:
        text.change(*_of_hosts(document))  # together, as hosts may stand in one range
    return Conversion(text.source.text, tuple(text.done), by_hand=(), undone=tuple(text.undone), notes=())


def _of_ros(document: Document, distro: str, used: Collection[str]) -> Iterator[Change]:
    """Sets the distribution, and removes the keys that its middleware does not read."""
    spec, data = document.spec, document.source.data
    if not isinstance(data.get("ros"), dict):
        yield set_to((), "ros", {"distro": distro})
    elif "distro" in data["ros"]:
        yield replaced(("ros", "distro"), distro)
    else:
        yield set_to(("ros",), "distro", distro)
    for key in sorted(spec.ros.model_fields_set.difference(used)):
        yield removed(("ros", key))


def _of_islands(document: Document) -> Iterator[Change]:
    for name, island in document.spec.islands.items():
        if island.distro is not None:
            yield removed(("islands", name, "distro"))


def _of_hosts(document: Document) -> Iterator[Change]:
    for name, host in document.spec.hosts.items():
        if "master_port" in host.model_fields_set:
            yield removed(("hosts", name, "master_port"))
