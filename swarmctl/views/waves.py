"""The order of a rollout as text."""

from __future__ import annotations

from rich.text import Text

from swarmctl.plan.waves import Order
from swarmctl.views.width import wrapped
from swarmctl.yamltext import hostlist

_TOGETHER = {
    "wave": "the hosts of a wave stay changed or go back together",
    "all": "all stay changed or go back together",
}


def order_text(order: Order, width: int | None = None) -> Text:
    """Returns which hosts change one after the other, and what becomes of them if one fails."""
    waves = ", then ".join(hostlist.written(wave) for wave in order.waves)
    rule = _TOGETHER.get(order.consistency)
    return wrapped(Text(f"order: {waves}{f'; {rule}' if rule else ''}"), width, 2)
