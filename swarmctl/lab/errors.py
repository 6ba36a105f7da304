"""What keeps a lab from running, for the person who must act."""

from __future__ import annotations


class LabError(Exception):
    """A message and what to do about it. Shown as text, never as a traceback."""

    def __init__(self, message: str, *help_lines: str) -> None:
        super().__init__(message)
        self.help_lines = help_lines
