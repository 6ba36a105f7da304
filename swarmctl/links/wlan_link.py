"""A wireless network between hosts."""

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
