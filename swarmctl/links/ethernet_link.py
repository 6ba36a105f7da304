"""A wired network between hosts."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from swarmctl.links.link_base import NetworkLink


class Ethernet(NetworkLink):
    """A wired network between hosts."""

    usual_mbps: ClassVar[float] = 90.0  # a Raspberry Pi up to 3B has fast ethernet, 94 with TCP
    interface_stem: ClassVar[str] = "eth"

    kind: Literal["ethernet"] = Field(description="What kind of link this is.")
