from __future__ import annotations

from pathlib import Path

import pytest

from tests.onboard.agent.change import OLD
from tests.onboard.agent.fakehost import FakeHost


@pytest.fixture
def host(tmp_path: Path) -> FakeHost:
    return FakeHost(tmp_path)


@pytest.fixture
def old(host: FakeHost) -> FakeHost:
    assert host.apply(OLD).answer["release"] == OLD.digest
    host.calls()
    return host
