"""The error that every lab function raises for the user."""

from __future__ import annotations


class LabError(Exception):
    """What is wrong and, in ``help_lines``, what to do about it.

    The command line prints it without a traceback.
    """

    def __init__(self, message: str, *help_lines: str) -> None:
        super().__init__(message)
        self.help_lines = help_lines
