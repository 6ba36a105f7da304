"""``python -m tests.e2e.outages LAB HOST SECONDS SWARMCTL...``: swarmctl, with outages of a host's network.

Each step of a deploy meets one: the network is away when swarmctl connects, when it sends a request, and when
the agent has begun. The steps that met one are printed as the last line of the errors.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from typing import Any

from swarmctl.__main__ import main
from swarmctl.lab import lab
from swarmctl.remote.agent_client import DirectAgentSession
from swarmctl.remote.ssh import SshTransport
from swarmctl.remote.ssh_channel import SshSession
from swarmctl.remote.transport import Target

STEPS = (
    "connect",
    "observe",
    "lease",
    "apply",
    "at work",
    "hold",
    "connect again",
    "confirm",
    "give back",
)


class Outages:
    """Cuts the cable of ``host`` for ``seconds`` at the first time of each step."""

    def __init__(self, name: str, host: str, seconds: float) -> None:
        self.host, self.met = host, []
        self._name, self._seconds = name, seconds
        self._joined: threading.Timer | None = None

    def begin(self, step: str) -> None:
        """``step`` begins without a network, which comes back by itself."""
        if step in self.met:
            return
        self.end()
        self.met.append(step)
        lab.cut(self._name, self.host)
        self._joined = threading.Timer(self._seconds, lab.join, [self._name, self.host])
        self._joined.start()

    def end(self) -> None:
        """Waits until the network is there."""
        if self._joined is not None:
            self._joined.join()


def patch(outages: Outages) -> None:
    """Has what swarmctl does with the host meet them."""
    connect, ask = SshTransport.connect, DirectAgentSession.request

    def connected(self: SshTransport, target: Target) -> AbstractContextManager[SshSession]:
        if target.host == outages.host:
            outages.begin("connect again" if "hold" in outages.met else "connect")
        return connect(self, target)

    def sent(
        self: DirectAgentSession,
        request: Mapping[str, Any],
        payload: bytes = b"",
        *,
        on_note: Callable[[str], None] | None = None,
        timeout: float = 60.0,
    ) -> Any:
        mine = self._session._host == outages.host

        def noted(text: str) -> None:
            if text.startswith("stopping"):
                outages.begin("at work")
            if on_note is not None:
                on_note(text)

        if mine:
            outages.begin("give back" if request.get("want") is False else request["verb"])
        return ask(self, request, payload, on_note=noted if mine else on_note, timeout=timeout)

    SshTransport.connect = connected
    DirectAgentSession.request = sent


if __name__ == "__main__":
    name, host, seconds, *argv = sys.argv[1:]
    outages = Outages(name, host, float(seconds))
    patch(outages)
    sys.argv = argv
    code = main()
    outages.end()
    print(", ".join(outages.met), file=sys.stderr)
    sys.exit(code)
