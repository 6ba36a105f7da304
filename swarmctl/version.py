"""The version, alone, so that all can import it."""

__version__ = "0.1.0"
