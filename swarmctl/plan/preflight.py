"""Notes on a host's preparation: missing tools, and settings without effect, each with a fix. Pure."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING

from swarmctl.plan.host_needs import TOOLS
from swarmctl.plan.observed_host import Observed
from swarmctl.plan.plan import Problem
from swarmctl.render.bundle import Bundle

if TYPE_CHECKING:
    from swarm_onboard.agent.verbs.observe import Facts

_OLDEST_PYTHON = (3, 8)
_CLOCKS_APART = 60.0  # s between the clocks of host and operator that are worth a note
#: The kind of the problem of a host that cannot run its part.
UNFIT = "unfit"
#: How the hint of a problem begins that `swarmctl prepare` solves.
PREPARE_INSTALLS = "`swarmctl prepare` installs it"


def unusable(facts: Facts) -> Problem | None:
    """Returns why nothing can make the host fit; None if something can."""
    if not facts.systemd:
        return Problem(UNFIT, "it does not run systemd", "swarmctl needs a host that boots with systemd")
    if _version(facts.python) < _OLDEST_PYTHON:
        return Problem(UNFIT, f"its Python is {facts.python}", "swarmctl needs Python 3.8 or newer on a host")
    return None


def without_secret(bundle: Bundle, observed: Observed) -> Problem | None:
    """Returns the problem of a unit whose secret nobody has, PINs aside; None if there is none."""
    for unit in bundle.units:
        needed = [name for name in unit.secrets if name in bundle.secret_forms]
        missing = [name for name in needed if observed.secrets.get(name) == "missing"]
        if missing:
            what = f"program {unit.program}" if unit.program else unit.name
            message = f"{what} needs the secret {missing[0]}, which is not on the host"
            return Problem(
                UNFIT, message, f"write it to `secrets/{missing[0]}` beside the spec (docs/secrets.md)"
            )
    return None


def notes(bundle: Bundle, observed: Observed) -> Iterator[str]:
    """Yields the notes. What keeps a unit from running is a problem instead (see ``reconcile``)."""
    facts = observed.facts
    if not facts:  # the host was not contacted
        return
    last = observed.transaction
    if last is not None and last.state == "undone":
        yield f"the deploy of release {last.next} by {last.who} did not stay: {last.error}"
    for unit in observed.foreign_units:
        yield (
            f"{unit} is named as a unit of the swarm, and swarmctl did not write it; to remove it: "
            f"sudo systemctl disable --now {unit}, then sudo rm /etc/systemd/system/{unit}"
        )
    if (apart := abs(observed.clock_ahead)) > _CLOCKS_APART:
        yield (
            f"its clock and this machine's differ by {_span(apart)}: logs and the stamps of messages do not "
            "fit; on both: timedatectl shows which is wrong"
        )
    saving = facts.power_save or {}
    for name in bundle.wants:
        # A host that a cable connects to the access point has no radio.
        if not facts.has.get(name) and not (name == "iw" and not saving):
            yield f"it lacks {TOOLS[name].note}"
    for name, secret in observed.secrets.items():
        if secret == "missing" and name not in bundle.secret_forms:  # a PIN
            yield (
                f"the secret {name} is missing on the host and beside the spec; "
                f"write it to `secrets/{name}` beside the spec (docs/secrets.md)"
            )
    if observed.digest != bundle.digest:  # this deploy fixes the rest
        return
    if bundle.follows and facts.clock == "alone":
        yield f"its clock does not follow {bundle.follows}; `chronyc sources` lists its time sources"
    for interface, state in saving.items():
        if state == "on":
            yield f"{interface} has power saving on; `systemctl restart` its wlan unit"


def _version(text: str) -> tuple[int, int]:
    """Major and minor; 0.0 for a text that is not a version."""
    found = re.match(r"(\d{1,4})\.(\d{1,4})", text, re.ASCII)
    return (int(found[1]), int(found[2])) if found else (0, 0)


def _span(seconds: float) -> str:
    """The time in the largest unit of which it has two."""
    for unit, length in (("years", 365.25 * 86400), ("days", 86400), ("hours", 3600), ("min", 60)):
        if seconds >= 2 * length:
            return f"{seconds / length:.0f} {unit}"
    return f"{seconds:.0f} s"
