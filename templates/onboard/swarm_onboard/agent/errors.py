"""Errors of the agent: a kind that swarmctl handles, a message, and a hint."""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any


class RefusedError(Exception):
    """The request is rejected; nothing has changed, or every change was undone."""

    kind = "refused"

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint


class FailedError(RefusedError):
    """The agent failed while it carried out the request."""

    kind = "failed"


class TimedOutError(FailedError):
    """A program did not end in time."""


class UploadEndedError(RefusedError):
    """The payload of ``request`` ended after its first bytes, ``received``."""

    def __init__(self, message: str, request: dict[str, Any], received: bytes) -> None:
        super().__init__(message, "run the same command again")
        self.request = request
        self.received = received


class OperatorGoneError(Exception):
    """The operator has disconnected before anything was changed."""
