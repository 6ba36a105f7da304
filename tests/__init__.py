"""Every test of the project. A folder mirrors the package that it tests; README.md says what lies where."""

from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
