"""Time limits of logins, and trying again where sshd drops newcomers."""

from __future__ import annotations

import random
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from swarmctl.remote.ssh_errors import DroppedError
from swarmctl.remote.transport import CHANNEL_TIMEOUT

FOREVER = 3e7  # s, a year: how long a command may run that a person waits for
SESSION_PAUSES = (0.05, 0.2, 0.5)  # s before a session is requested again: sshd may count one just closed

R = TypeVar("R")


@dataclass(frozen=True)
class Timeouts:
    """Time limits of a login, in seconds."""

    connect: float = 8.0  # the fourth attempt of TCP comes after 7 s (tcp(7): tcp_syn_retries)
    banner: float = 10.0
    auth: float = 15.0
    channel: float = CHANNEL_TIMEOUT
    acknowledgement: float = 15.0  # of what was sent; then the connection counts as lost


def patiently(attempts: int, opened: Callable[[], R]) -> R:
    """Returns what ``opened`` returns, tried again a moment later as long as the host drops newcomers."""
    attempt = 1
    while True:
        try:
            return opened()
        except DroppedError:
            if attempt == attempts:
                raise
        time.sleep(random.uniform(0.2, 0.6) * attempt)
        attempt += 1
