"""The protocol of one kind of robot: values to bytes, bytes to values. It runs on robots: Python 3.8.

An exception is a failed exchange: /diagnostics reports it with its line, and the robot is still stopped.
"""

from swarm_onboard.driver.codec import BadReplyError, Reply, Request
from swarm_onboard.driver.line_protocol import LineBuffer


class OwnCodec:
    """Every request with its reader, which is given the bytes of the reply as they come."""

    def __init__(self, options):
        """``options`` are those of the robot type. Made anew for each connection."""

    def speed(self, left, right):
        """Sets both wheel speeds, in the robot's units; zeros stop it."""
        return self._request(f"S,{left},{right}", "s")

    def query(self, name):
        """Sends the query ``name`` of the robot type."""
        request = {"position": "P", "floor": "F", "eyes": "E", "battery": "V"}[name]
        return self._request(request, request.lower())

    def actuator(self, actuator, index, values):
        """Sets the channel ``index`` of an actuator to ``values[0]``."""
        return self._request(f"{actuator.name},{index},{values[0]}", "l")

    def identify(self):
        """Requests the firmware version: the first number in the reply. Called with `identify: true`."""
        return self._request("B", "b")

    def _request(self, text, head):
        return Request(text.encode("ascii") + b"\r", text, lambda: _Reader(head))


class _Reader:
    """Waits for the reply that begins with ``head``. What it skips is noise."""

    def __init__(self, head):
        self.noise = 0
        self.stray = ""
        self._head = head
        self._lines = LineBuffer()

    def feed(self, data):
        """The reply once ``data`` completes it, else None."""
        for line in self._lines.feed(data):
            head, _, rest = line.decode("ascii", "replace").partition(",")
            if head == self._head:
                return Reply(_numbers(rest), rest)
            self.noise += 1
        return None


def _numbers(text):
    try:
        return tuple(int(one) for one in text.split(",")) if text else ()
    except ValueError:
        raise BadReplyError(f"`{text}` is not made of numbers") from None
