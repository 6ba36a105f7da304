"""What a host lacks for its preparation, or what that has not brought about, each with the mend. Pure."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.plan.observed import Observed
from swarmctl.render.bundle import Bundle

_LACKS = {
    "chronyd": "chrony: it keeps a time of its own; `apt install chrony`, then deploy again",
    "bluetoothctl": "bluetoothctl: nothing pairs its robots; `apt install bluez`, then deploy again",
    "rfcomm": "rfcomm: its Bluetooth robots have no line; `apt install bluez`, then deploy again",
    "avrdude": "avrdude: `swarmctl firmware flash` cannot write its boards; `apt install avrdude`",
    "iw": "iw: power saving of its wlan stays as it is; `apt install iw`, and reboot it",
}


def notes(bundle: Bundle, observed: Observed) -> Iterator[str]:
    """Nothing that keeps a unit from running: that is a problem, not a note."""
    facts = observed.facts
    if not facts:  # nobody asked the host
        return
    saving = facts.get("power_save", {})
    for name in bundle.wants:
        # A host that is on the wlan by a cable to its access point has no radio to keep awake.
        if not facts["has"].get(name) and not (name == "iw" and not saving):
            yield f"it lacks {_LACKS[name]}"
    for name, state in observed.secrets.items():
        if state == "missing":
            yield (
                f"the secret {name} is neither there nor on your side; "
                f"put it into `secrets/{name}` beside the spec (docs/secrets.md)"
            )
    if observed.digest != bundle.digest:  # what follows is for this deploy to mend
        return
    if bundle.follows and facts.get("clock") == "alone":
        yield f"its clock does not follow that of {bundle.follows}; `chronyc sources` tells what it hears"
    for interface, state in saving.items():
        if state == "on":
            yield f"{interface} saves power again; `systemctl restart` the unit that keeps the wlan awake"
