"""Why systemd skips a unit: its conditions that are not met, in words, each with its repair. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from posixpath import basename

_ADAPTERS, _RFCOMM, _SECRETS = "/sys/class/bluetooth/", "/usr/bin/rfcomm", "/secrets/"


def explained(host: str, unit: str, unmet: Sequence[str]) -> tuple[str, str]:
    """Returns why ``unit`` is skipped on ``host``, and the repair.

    ``unmet``: the conditions that are not met now, such as ``ConditionPathExists=/PATH``.
    """
    if not unmet:  # they were not when the unit was to start
        return "a condition was not met when it was to start, and is met now", _start(host, unit)
    places = [one.partition("=")[2] for one in unmet]
    whys, repairs = zip(*(_one(host, place) for place in places), strict=True)
    again = "then run swarmctl deploy"
    return "; ".join(whys), "; ".join((*dict.fromkeys(repairs), again))


def _one(host: str, place: str) -> tuple[str, str]:
    name = basename(place)
    if place.startswith(_ADAPTERS):
        hint = f"connect it, or correct `adapter` of the link; on {host}: ls {_ADAPTERS} lists those it has"
        return f"{host} has no Bluetooth adapter {name}", hint
    if place == _RFCOMM:
        return f"{host} lacks {place}", "`swarmctl prepare` installs it (package bluez)"
    if _SECRETS in place:
        return f"the secret {name} is not on {host}", f"write it to `secrets/{name}` beside the spec"
    return f"{place} does not exist on {host}", "create it"


def _start(host: str, unit: str) -> str:
    return f"on {host}: sudo systemctl start {unit}"
