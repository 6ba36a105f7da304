"""The programs that swarmctl ships: what `use` may name, and how each is run."""

from __future__ import annotations

SHIPPED = {
    "teleop-joy": "a gamepad commands robots while its dead-man button is held",
    "teleop-key": "a keyboard commands robots while a key is held",
}
SCRIPTS = {"teleop-joy": "teleop_joy.py", "teleop-key": "teleop_key.py"}
INTERACTIVE = frozenset({"teleop-key"})  # for a person at a terminal: no unit runs them
