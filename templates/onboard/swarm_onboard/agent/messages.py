"""Words in the answers of several verbs. Types only."""

from __future__ import annotations

from typing import Literal

FileDrift = Literal["changed", "missing", "extra", "damaged"]
LinkDrift = Literal["changed", "missing", "extra", "foreign"]
BlockDrift = Literal["changed", "missing", "extra", "broken"]
SecretState = Literal["same", "other", "new", "kept", "missing"]
