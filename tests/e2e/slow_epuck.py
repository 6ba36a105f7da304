"""A slow e-puck, as real ones are: while it makes and sends an image it reads nothing."""

from __future__ import annotations

from collections import deque

from swarmctl.lab.emulators.epuck import EPuck

BAUD = 115200
CAPTURE = 0.24  # s that the camera takes; 0.25 are allowed
PIECE = 64  # bytes that arrive at once
IMAGE = "b7 00"  # its request


class SlowEPuck(EPuck):
    """One request after the other: what comes while an answer is on its way is taken up when that is out."""

    def _set_defaults(self) -> None:
        super()._set_defaults()
        self._unheard = bytearray()
        self._coming: deque[tuple[float, bytes]] = deque()  # pieces, and when they are out

    def replies(self, data: bytes) -> list[bytes]:
        self._unheard += data
        self._take_up()
        return []

    def _take_up(self) -> None:
        while self._unheard and not self._coming:
            for answer in super().replies(bytes([self._unheard.pop(0)])):
                self._send(answer)

    def _send(self, answer: bytes) -> None:
        at = self.chassis.time + (CAPTURE if self._last_command == IMAGE else 0.0)
        for start in range(0, len(answer), PIECE):
            piece = answer[start : start + PIECE]
            at += len(piece) * 10 / BAUD
            self._coming.append((at, piece))

    def unsolicited_due(self) -> float:
        return self._coming[0][0] - self.chassis.time if self._coming else super().unsolicited_due()

    def unsolicited(self) -> list[bytes]:
        _, piece = self._coming.popleft()
        self._take_up()
        return [piece]
