"""The date of a host is wrong, and steps in a deploy: its deadlines, leases and kept releases are as ever."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.onboard.agent import fakehost
from tests.onboard.agent.fakehost import FakeHost, bundle

BOOT = fakehost.BOOT
YEAR = 365.25 * 86400  # s
RELEASES = tuple(bundle(str(number)) for number in range(1, 5))
OLD, NEW = RELEASES[:2]
TXID = "0123456789abcdef"


@pytest.fixture(params=[(-50, -50, -50), (10, 10, 10), (0, 10, -50)], ids=str)
def dates(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Dates:
    """How many years the date is wrong, for one agent after the other."""
    return Dates(request.param, monkeypatch)


class Dates:
    def __init__(self, years: tuple[int, ...], patch: pytest.MonkeyPatch) -> None:
        self.years = list(years)
        self._patch = patch

    def step(self) -> None:
        """Gives the agents from here on the next date."""
        ahead = self.years.pop(0) * YEAR
        clock = f"import time; now = time.time; time.time = lambda: now() + {ahead}; "
        self._patch.setattr(fakehost, "BOOT", clock + BOOT)


def test_a_change_is_confirmed_whatever_the_date(tmp_path: Path, dates: Dates) -> None:
    host = FakeHost(tmp_path)
    dates.step()
    assert host.apply(OLD).answer
    change: dict[str, Any] = {"previous": OLD.digest, "start": [], "restart": ["koala.service"], "txid": TXID}
    assert host.apply(NEW, **change, confirm_within=100).answer
    dates.step()
    assert 0 < host.observe().transaction.left <= 100
    dates.step()
    assert host.ask({"verb": "confirm", "swarm": "new", "txid": TXID}).answer == {"release": NEW.digest}
    assert [one.next for one in host.history()] == [OLD.digest, NEW.digest]


def test_a_lease_lasts_as_long_whatever_the_date(tmp_path: Path, dates: Dates) -> None:
    host = FakeHost(tmp_path)
    lease = {"verb": "lease", "swarm": "new", "want": True}
    dates.step()
    assert host.ask({**lease, "run": "a" * 16, "who": "ann"}).answer["granted"]
    dates.step()
    other = host.ask({**lease, "run": "b" * 16, "who": "bob"}).answer
    assert (other["granted"], other["who"]) == (False, "ann")
    assert 0 < other["left"] <= 60
    dates.step()
    assert host.ask({**lease, "want": False, "run": "a" * 16}).answer["left"] == 0


def test_the_last_three_releases_are_kept_whatever_the_date(tmp_path: Path, dates: Dates) -> None:
    host, before = FakeHost(tmp_path), None
    for release in RELEASES:
        if dates.years:
            dates.step()
        assert host.apply(release, previous=before, start=[]).answer
        before = release.digest
    assert host.observe().releases == sorted(one.digest for one in RELEASES[1:])
