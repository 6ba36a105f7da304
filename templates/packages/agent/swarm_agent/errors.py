"""Errors of the agent: a kind that swarmctl handles, a message, and a hint."""

from __future__ import annotations


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


class OperatorGoneError(Exception):
    """The operator has disconnected before anything was changed."""
