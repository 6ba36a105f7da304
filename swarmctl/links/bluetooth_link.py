"""A Bluetooth serial connection between a host and a robot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

from pydantic import Field

from swarmctl.field_types import Adapter, Mac
from swarmctl.links.link_base import Delay, Device, Line
from swarmctl.named_secret import Secret


@dataclass(frozen=True)
class RfcommLine:
    """A Bluetooth serial line: the robot's MAC, the adapter, the channel, and the bound rfcomm device.

    ``pin`` is the name of the secret with the pairing PIN.
    """

    mac: str
    channel: int
    index: int
    adapter: str
    pin: str | None = None

    @property
    def path(self) -> str:
        return f"/dev/rfcomm{self.index}"

    @property
    def title(self) -> str:
        return f"the Bluetooth line to {self.mac}"


class Bluetooth(Line):
    """A Bluetooth serial connection (RFCOMM) between a host and a robot."""

    device_keys: ClassVar[tuple[str, ...]] = ("mac", "pin", "channel")
    adapters_key: ClassVar[str] = "bluetooth"
    title: ClassVar[str] = "Bluetooth"
    placeholders: ClassVar[Mapping[str, str]] = {"device": "the device of its {} link"}
    example: ClassVar[str] = 'mac: "..."'
    # An e-puck answers for all its sensors of few bytes in one exchange at about 30 Hz (epuck_driver's launch
    # file), of which 20 ms carry no bytes; request and reply take at least four slots of 625 us.
    delays: ClassVar[Mapping[str, Delay]] = {"bluetooth": Delay(0.020, 0.0025)}
    unknown_end: ClassVar[Mapping[str, Any]] = {"mac": "10:00:e8:c5:64:37"}
    where_to_find: ClassVar[str] = "the robot's Bluetooth address, which `bluetoothctl scan on` shows"

    kind: Literal["bluetooth"] = Field(description="What kind of link this is.")
    mac: Mac = Field(description="The robot's Bluetooth address, in quotes.")
    pin: Secret | None = Field(
        None, description="Pairing PIN as {secret: NAME}; a spec never contains the PIN itself."
    )
    adapter: Adapter | None = Field(None, description="Which adapter of the host; its first by default.")
    channel: int | None = Field(
        None, ge=1, le=30, examples=[1], description="RFCOMM channel; the robot type's own by default."
    )

    @classmethod
    def first_value(cls, number: int, robot: str, dongle: int) -> str:
        return f"02:00:00:00:{number // 100:02}:{number % 100:02}"

    def served_by(self, adapters: tuple[str, ...]) -> str | None:
        return self.adapter or next(iter(adapters), None)

    def moving(self, host: str) -> str:
        return f"pair `{self.robot}` with a Bluetooth adapter of `{host}`"

    def device_of(self, number: int, channel: int, adapter: str) -> Device:
        pin = self.pin.secret if self.pin else None
        return RfcommLine(self.mac, self.channel or channel, number, adapter, pin)
