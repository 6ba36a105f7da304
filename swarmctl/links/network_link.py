"""Networks between hosts: wireless and wired."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from swarmctl.links.link_base import NetworkLink


class Wlan(NetworkLink):
    """A wireless network between hosts."""

    # 802.11g carries about 22, and a packet goes to the access point and on from there.
    usual_mbps: ClassVar[float] = 10.0
    interface_stem: ClassVar[str] = "wlan"
    wireless: ClassVar[bool] = True

    kind: Literal["wlan"] = Field(description="What kind of link this is.")
    client_isolation: bool | None = Field(
        None, description="Whether the access point keeps its clients apart."
    )


class Ethernet(NetworkLink):
    """A wired network between hosts."""

    usual_mbps: ClassVar[float] = 90.0  # a Raspberry Pi up to 3B has fast ethernet, 94 with TCP
    interface_stem: ClassVar[str] = "eth"

    kind: Literal["ethernet"] = Field(description="What kind of link this is.")
