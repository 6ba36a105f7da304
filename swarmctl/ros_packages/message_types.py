"""Whether a message type exists, and which one is meant if it does not."""

from __future__ import annotations

from dataclasses import dataclass

from swarmctl.ros_packages.message_catalog import MessageCatalog
from swarmctl.suggest import guess, typing_errors

_MOST_USED = (
    "std_msgs",
    "geometry_msgs",
    "sensor_msgs",
    "nav_msgs",
    "tf2_msgs",
)  # the first that has it is meant


@dataclass(frozen=True)
class NoMessage:
    """A message type that does not exist. ``meant`` are the likely types, the best first."""

    why: str
    meant: tuple[str, ...]
    certain: bool  # False if the whole package is unknown, and only looks misspelt


def no_message(name: str, known: MessageCatalog) -> NoMessage | None:
    """Returns what is wrong with the message type ``name``; None for one that exists or may exist."""
    package, _, message = name.partition("/")
    if name in known.sums:
        return None
    if package not in known.packages:
        return _unknown_package(package, message, known)
    same = {one.lower(): one for one in _in_package(package, known)}
    if message.lower() in same:
        spelt = f"{package}/{same[message.lower()]}"
        return NoMessage("it is spelt with other capitals", (spelt,), certain=True)
    meant = _meant(package, message, known)
    for article, kind, names in (("a", "service", known.services), ("an", "action", known.actions)):
        if name in names:
            of_action = tuple(f"{name}{part}" for part in ("ActionGoal", "ActionFeedback", "ActionResult"))
            return NoMessage(
                f"it is {article} {kind}", of_action if kind == "action" else meant, certain=True
            )
    return NoMessage(f"`{package}` has no such message", meant, certain=True)


def _unknown_package(package: str, message: str, known: MessageCatalog) -> NoMessage | None:
    """A package that is not known is somebody's own, unless a known one differs by a letter or two."""
    alike = [one for one in sorted(known.packages) if typing_errors(package, one) <= 2]
    meant = tuple(f"{one}/{message}" for one in alike if f"{one}/{message}" in known.sums)
    return NoMessage(f"no known package is called `{package}`", meant, certain=False) if meant else None


def _meant(package: str, message: str, known: MessageCatalog) -> tuple[str, ...]:
    """The same name in another package, or a similar name in the same one."""
    elsewhere = [one for one in known.sums if one.endswith(f"/{message}")]
    elsewhere.sort(key=lambda one: (_rank(one.partition("/")[0]), one))
    alike = guess(message, _in_package(package, known))
    near, similar = alike.only, [f"{package}/{one}" for one in alike.words]
    if near and message.lower().removesuffix("s") == near.lower().removesuffix("s"):
        return (*similar, *elsewhere)
    return (*elsewhere, *similar)


def _rank(package: str) -> int:
    return _MOST_USED.index(package) if package in _MOST_USED else len(_MOST_USED)


def _in_package(package: str, known: MessageCatalog) -> list[str]:
    return [one.partition("/")[2] for one in known.sums if one.startswith(f"{package}/")]
