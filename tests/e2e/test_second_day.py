"""The second day: a cable is pulled while a robot drives; page, status, logs, report and bag agree on it."""

from __future__ import annotations

import json
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect

from swarmctl.cli import exit_codes
from swarmctl.health import report_archive
from swarmctl.health.host_logs import Entry
from swarmctl.lab import lab
from tests.e2e.bags import ended, forget, is_recording, messages
from tests.e2e.lab_swarm import LEADER, SWARMCTL, LabSwarm, until
from tests.timing import PATIENCE, Promise, wait_for
from tests.ui.browser import chromium, opened

CAUSE, LOGGED = "device k3", "/dev/swarm/k3 is gone"
FINE = ("ok", "warning")  # a publisher that another test has killed stays a warning
AGREE = 2.0  # s


@pytest.fixture(autouse=True)
def _clean(swarm: LabSwarm) -> Iterator[None]:
    yield
    forget(swarm)


@contextmanager
def page_of(process: subprocess.Popen[str], browser: Browser) -> Iterator[Page]:
    """The page of a `swarmctl ui`."""
    try:
        assert process.stdout is not None
        with opened(browser, process.stdout.readline().strip()) as page:
            yield page
    finally:
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=PATIENCE)


def state(page: Page, robot: str = "k3") -> str | None:
    return page.locator(f'[data-id="robot:{robot}"]').get_attribute("data-state")


def causes(status: dict[str, Any]) -> list[str]:
    bad = [one for one in status["findings"] if one["state"] == "bad"]
    return [one["key"] for one in bad if one["cause"] is None]


def test_all_that_people_look_at_agrees_on_a_pulled_cable(
    swarm: LabSwarm, tmp_path: Path, promise: Promise
) -> None:
    bags, archive = tmp_path / "bags", tmp_path / "report.tar.gz"
    recording = swarm.begin("record", "/k3/*", "--limit", "k3-pi", "--out", str(bags), "--json")
    wait_for(partial(is_recording, swarm, "k3-pi"), interval=0.2)
    with chromium() as browser:
        with page_of(swarm.begin("ui"), browser) as page:
            until(lambda: state(page) in FINE, "the page shows no state")
            try:
                with swarm.driving(LEADER, "k3", 0.1):
                    until(lambda: page.evaluate("robots.get('k3').driven[0]") > 0.05, "k3 stands")
                    lab.unplug(swarm.name, "k3")
                    pulled = time.time()
                until(lambda: state(page) == "bad", "the page does not show the cable")
                promise("second day: from a pulled cable to the page", time.time() - pulled, AGREE)
                began = time.time()
                status = swarm.swarmctl("status", "--json")
                promise("second day: from a pulled cable to a look that finds it", began - pulled, AGREE)
                expect(page.locator("#findings button", has_text=CAUSE)).to_be_visible()
                logs = swarm.swarmctl("logs", "k3", "--json")
                assert swarm.swarmctl("report", "--out", str(archive)).status == exit_codes.OK
                recording.send_signal(signal.SIGINT)
                code, hosts = ended(recording)
            finally:
                lab.plug(swarm.name, "k3")
            until(lambda: state(page) in FINE, "the page does not show the repair")
        assert causes(status.json()) == [CAUSE]
        reported = report_archive.read(archive).look.status
        assert causes(reported.to_json()) == [CAUSE]
        live = [Entry(**json.loads(line)) for line in logs.out.splitlines()]
        for entries in (live, report_archive.graph_and_logs(archive)[1]):
            logged = [one.time for one in entries if LOGGED in one.message][-1]
            promise("second day: from a pulled cable to its log entry", abs(logged - pulled), AGREE)
        assert code == exit_codes.OK, hosts
        (bag,) = map(Path, hosts["k3-pi"]["bags"])
        _, last, odometry = messages(bag, "/k3/odom")[-1]
        promise("second day: from a pulled cable to the last message", abs(last - pulled), AGREE)
        command = [str(SWARMCTL), "ui", "--from", str(archive), "--bags", str(bags)]
        replay = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        with page_of(replay, browser) as page:
            expect(page.locator("#findings button", has_text=CAUSE)).to_be_visible()
            page.locator("#slider").focus()
            page.keyboard.press("End")
            seen, place = page.evaluate("robots.get('k3').pose"), odometry.pose.pose.position
            assert seen[:2] == pytest.approx([place.x, place.y], abs=0.01)
    healthy = swarm.swarmctl("status")
    assert healthy.status == exit_codes.OK, healthy.out
