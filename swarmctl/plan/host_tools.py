"""Programs beside ROS that a host may lack: the Debian package of each, and what does not work without it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from swarmctl.render.middleware import middleware_of


@dataclass(frozen=True)
class Tool:
    """``without`` describes the host that lacks it, ``then`` what takes it into use."""

    package: str
    without: str = ""
    then: str = ""

    @property
    def note(self) -> str:
        """What a plan notes about a host that lacks it."""
        return f"{self.without}; `swarmctl prepare` installs it (`apt install {self.package}`){self.then}"


TOOLS = {
    "chronyd": Tool("chrony", "chrony: its clock is not synchronised", ", then deploy again"),
    "bluetoothctl": Tool("bluez", "bluetoothctl: its robots cannot be paired", ", then deploy again"),
    "rfcomm": Tool("bluez", "rfcomm: its Bluetooth robots have no serial line", ", then deploy again"),
    "avrdude": Tool("avrdude", "avrdude: `swarmctl firmware flash` cannot write its boards"),
    "iw": Tool("iw", "iw: wlan power saving stays on", ", then reboot"),
    "nft": Tool("nftables"),
    "wg": Tool("wireguard-tools"),
    "podman": Tool("podman"),
    "docker": Tool("docker.io"),
}


def install_hints(distro: str, missing: Sequence[str]) -> Iterator[str]:
    """Yields what to do on a host that lacks ``missing``: tools first, then what belongs to its ROS."""
    if tools := [TOOLS[one].package for one in missing if one in TOOLS]:
        yield f"`apt install {' '.join(tools)}`"
    yield from middleware_of(distro).install_hints([one for one in missing if one not in TOOLS])
