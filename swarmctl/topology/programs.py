"""The programs that swarmctl ships: what `use` may name."""

from __future__ import annotations

SHIPPED = {
    "teleop-joy": "a gamepad commands robots while its dead-man button is held",
    "teleop-key": "a keyboard commands robots while a key is held",
}
