"""A radio link between a Crazyradio dongle of a host and a Crazyflie."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Literal

from pydantic import Field

from swarmctl.field_types import LAST_CHANNEL, RADIO_RATES, RadioUri
from swarmctl.links.link_base import Ends, RobotLink


class Radio(RobotLink):
    """A radio link between a Crazyradio dongle of a host and a Crazyflie."""

    device_keys: ClassVar[tuple[str, ...]] = ("uri",)
    title: ClassVar[str] = "radio"
    placeholders: ClassVar[Mapping[str, str]] = {"uri": "its link as a URI: {}"}
    example: ClassVar[str] = "uri: radio://0/80/2M/E7E7E7E7E7"
    unknown_end: ClassVar[Mapping[str, str]] = {"uri": "radio://0/80/2M/E7E7E7E7E7"}
    where_to_find: ClassVar[str] = (
        "the dongle, channel, rate and address of the Crazyflie, as cfclient shows them"
    )

    kind: Literal["radio"] = Field(description="What kind of link this is.")
    uri: RadioUri = Field(
        description="radio://DONGLE/CHANNEL/RATE/ADDRESS: the number of the dongle on its host, a channel "
        "from 0 to 125, the data rate (250K, 1M or 2M), and the Crazyflie's address, E7E7E7E7E7 by default."
    )

    @classmethod
    def first_value(cls, number: int, robot: str, dongle: int) -> str:
        return f"radio://{dongle}/{2 * number % LAST_CHANNEL}/2M/E7E7E7{number:04}"

    @property
    def dongle(self) -> str:
        """The Crazyradio of its host, such as crazyradio0."""
        return f"crazyradio{self.uri.split('/')[2]}"

    @property
    def channel(self) -> int:
        """The channel, 1 MHz apart from the next."""
        return int(self.uri.split("/")[3])

    @property
    def rate(self) -> int:
        """Bits per second on the air."""
        return RADIO_RATES[self.uri.split("/")[4]]

    @property
    def address(self) -> str:
        """The address of the Crazyflie, ten hexadecimal digits."""
        return self.uri.split("/")[5]

    def served_by(self, adapters: tuple[str, ...]) -> str | None:
        return self.dongle

    def label(self, adapter: str | None, port: int | None) -> str:
        return f"{self.dongle}, channel {self.channel}"

    def values(self, ends: Ends) -> dict[str, str | int]:
        return {"uri": self.uri}

    def moving(self, host: str) -> str:
        return f"plug a Crazyradio for `{self.robot}` into `{host}` as its {self.dongle}"

    def check(self, host: str) -> str:
        return f"switch the robot on, and plug in the Crazyradio; both must have the values of {self.uri}"
