"""The type of each verb's answer, but for those in modules of their own."""

from __future__ import annotations

from typing import Mapping

from .probe_messages import ProbeAnswer

#: The type of the answer by verb.
ANSWERS: Mapping[str, type] = {"probe": ProbeAnswer}
