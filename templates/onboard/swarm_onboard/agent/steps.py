"""The steps of a change on a host: those that a plan prints, and of these what the agent takes from it."""

from __future__ import annotations

from .errors import RefusedError
from .manifest import unit_names
from .named_tuple import NamedTuple
from .paths import READERS

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, Final, Iterable, Literal


class Kind:
    """What a step does, in the order in which a plan has them."""

    SECRET: Final = "secret"
    KEY: Final = "key"
    CREATE: Final = "create"
    UPDATE: Final = "update"
    DELETE: Final = "delete"
    STOP: Final = "stop"
    ACTIVATE: Final = "activate"
    LINK: Final = "link"
    UNLINK: Final = "unlink"
    BLOCK: Final = "write-block"
    RELOAD: Final = "reload"
    RELOAD_UNIT: Final = "reload-unit"
    RESTART: Final = "restart"
    START: Final = "start"


_OF_UNITS = (Kind.STOP, Kind.RELOAD_UNIT, Kind.RESTART, Kind.START)
#: Those that the agent takes from a plan. What else it has to do it finds by comparing the host with the
#: manifest, in which a change that was interrupted is finished or undone, too.
TAKEN = (*_OF_UNITS, Kind.RELOAD)


class Step(NamedTuple):
    """One action on a target (a file, a unit, a link), with its cause."""

    kind: Literal[
        "secret",
        "key",
        "create",
        "update",
        "delete",
        "stop",
        "activate",
        "link",
        "unlink",
        "write-block",
        "reload",
        "reload-unit",
        "restart",
        "start",
    ]
    target: str
    cause: str


def targets(steps: Iterable[Step], *kinds: str) -> list[str]:
    """Returns the targets of the steps of these kinds."""
    return [step.target for step in steps if step.kind in kinds]


def taken(values: Any) -> list[Step]:
    """Returns the steps of a request. Raises ``RefusedError``."""
    try:
        found = [Step(*value) for value in values]
    except TypeError:
        raise RefusedError(f"{values!r} are no steps") from None
    unit_names(targets(found, *_OF_UNITS))
    for step in found:
        if step.kind not in TAKEN or (step.kind == Kind.RELOAD and step.target not in READERS):
            raise RefusedError(f"{step.kind} {step.target} is no step of an agent")
    return found
