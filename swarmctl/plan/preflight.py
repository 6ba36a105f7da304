"""Notes on a host's preparation: missing tools, and settings without effect, each with a fix. Pure."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.plan.observed_host import Observed
from swarmctl.render.bundle import Bundle

_LACKS = {
    "chronyd": "chrony: its clock is not synchronised; `apt install chrony`, then deploy again",
    "bluetoothctl": "bluetoothctl: its robots cannot be paired; `apt install bluez`, then deploy again",
    "rfcomm": "rfcomm: its Bluetooth robots have no serial line; `apt install bluez`, then deploy again",
    "avrdude": "avrdude: `swarmctl firmware flash` cannot write its boards; `apt install avrdude`",
    "iw": "iw: wlan power saving stays on; `apt install iw`, then reboot",
}


def notes(bundle: Bundle, observed: Observed) -> Iterator[str]:
    """Yields the notes. What keeps a unit from running is a problem instead (see ``reconcile``)."""
    facts = observed.facts
    if not facts:  # the host was not contacted
        return
    saving = facts.get("power_save", {})
    for name in bundle.wants:
        # A host that a cable connects to the access point has no radio.
        if not facts["has"].get(name) and not (name == "iw" and not saving):
            yield f"it lacks {_LACKS[name]}"
    for name, secret in observed.secrets.items():
        if secret == "missing":
            yield (
                f"the secret {name} is missing on the host and beside the spec; "
                f"write it to `secrets/{name}` beside the spec (docs/secrets.md)"
            )
    if observed.digest != bundle.digest:  # this deploy fixes the rest
        return
    if bundle.follows and facts.get("clock") == "alone":
        yield f"its clock does not follow {bundle.follows}; `chronyc sources` lists its time sources"
    for interface, state in saving.items():
        if state == "on":
            yield f"{interface} has power saving on; `systemctl restart` its wlan unit"
