"""A codec's time limit is long here: a call beyond it ends the process, and with it the test run."""

from __future__ import annotations

import pytest
from swarm_onboard.driver import user_codec

from tests.timing import PATIENCE


@pytest.fixture(autouse=True)
def time_limit_of_codecs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(user_codec, "_TIME_LIMIT", PATIENCE)
