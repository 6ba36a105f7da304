"""``swarmctl ui`` before a real swarm: a pulled cable, a host that is gone, robots that drive and stop."""

from __future__ import annotations

import re
import signal
import time
from collections.abc import Iterator

import pytest
from playwright.sync_api import Page, expect

from swarmctl.cli import exit_codes
from swarmctl.lab import lab
from tests import ROOT
from tests.e2e.lab_swarm import LEADER, LabSwarm, moves, until
from tests.timing import PATIENCE, Promise
from tests.ui.browser import chromium, opened

SPEED = 0.1  # m/s
WELL = re.compile(r"^\s*healthy")  # a publisher that another test has killed stays a warning
FINE = re.compile("ok|warning")
CABLE = 2.0  # s
GONE = 6.0  # s


@pytest.fixture
def page(swarm: LabSwarm) -> Iterator[Page]:
    """The page once it shows that all is well, and the connection of each host that it looks at."""
    with chromium() as browser:
        process = swarm.begin("ui", "--control")
        try:
            assert process.stdout is not None
            with opened(browser, process.stdout.readline().strip()) as found:
                expect(found.locator("#state")).to_have_text(WELL)
                yield found
        finally:
            process.send_signal(signal.SIGINT)
            _, complaints = process.communicate(timeout=PATIENCE)
            assert "Traceback" not in complaints
            assert process.returncode == exit_codes.OK


def shown(page: Page, robot: str, state: str | re.Pattern[str]) -> None:
    expect(page.locator(f'[data-id="robot:{robot}"]')).to_have_attribute("data-state", state)


def test_a_pulled_cable_shows_with_its_cause_until_it_is_plugged(
    swarm: LabSwarm, page: Page, promise: Promise, regenerating: bool
) -> None:
    lab.unplug(swarm.name, "k3")
    began = time.monotonic()
    shown(page, "k3", re.compile("unknown|bad"))
    promise("page of swarmctl ui: from a pulled cable until it shows it", time.monotonic() - began, CABLE)
    shown(page, "k3", "bad")
    finding = page.locator("#findings button", has_text="device k3")
    finding.click()
    expect(page.locator("#details")).to_contain_text("Remedy:")
    if regenerating:
        page.screenshot(path=ROOT / "docs/ui-graph.png")
    page.get_by_role("button", name="Reload").click()
    expect(page.locator("#log .level-error", has_text="/dev/swarm/k3").first).to_be_visible()
    shown(page, "koala", FINE)
    lab.plug(swarm.name, "k3")
    expect(page.locator("#state")).to_have_text(WELL)
    expect(finding).to_have_count(0)


def test_robots_that_drive_are_seen_and_stopped_with_proof(
    swarm: LabSwarm, page: Page, regenerating: bool
) -> None:
    with swarm.driving(LEADER, "k3", SPEED, 0.2):
        page.locator('[data-id="robot:k3"]').click()
        expect(page.locator("#details")).to_contain_text(LEADER)
        until(lambda: page.evaluate("robots.get('k3').driven[0]") > SPEED / 2, "its speed is not shown")
        commanded = page.evaluate("robots.get('k3').commanded")
        assert commanded == pytest.approx([SPEED, 0.2])
        if regenerating:
            page.get_by_role("button", name="Arena").click()
            with swarm.driving(LEADER, "koala", 2 * SPEED, -0.4), swarm.driving(LEADER, "epuck", SPEED, 0.5):
                page.wait_for_timeout(9000)
            page.screenshot(path=ROOT / "docs/ui-arena.png")
        page.get_by_role("button", name="Stop all robots").click()
        expect(page.locator("#results li", has_text="k3 ")).to_contain_text("stands: by its wheels")
        assert not moves(swarm.robot("k3"))
        expect(page.locator("#details")).to_contain_text("stopped by swarmctl stop")
        seen = page.evaluate("robots.get('k3').pose")
        odometry = swarm.odometry("k3-pi", "k3")
        assert seen[:2] == pytest.approx([odometry.x, odometry.y], abs=0.01)
        page.get_by_role("button", name="Release all").click()
        expect(page.locator("#results li", has_text="released")).to_have_count(len(swarm.robots()))
        until(lambda: moves(swarm.robot("k3")), "the robot does not obey after its release")


def test_a_host_that_is_cut_off_costs_itself_alone(swarm: LabSwarm, page: Page, promise: Promise) -> None:
    swarm.cut("k3-pi")
    began = time.monotonic()
    try:
        expect(page.locator('[data-id="host:k3-pi"]')).to_have_attribute("data-state", "bad")
        promise("page of swarmctl ui: from a cut network until it shows it", time.monotonic() - began, GONE)
        expect(page.locator("#age")).not_to_contain_text("OUT OF DATE")
        for robot in ("koala", "epuck"):
            shown(page, robot, FINE)
    finally:
        swarm.join("k3-pi")
    expect(page.locator("#state")).to_have_text(WELL)


def test_a_closed_page_leaves_nothing_on_the_hosts(swarm: LabSwarm, page: Page) -> None:
    agents = "pgrep -fc '[s]warm_onboard|[p]ython3 -I -S' || true"
    assert int(swarm.shell("k3-pi", agents)) > 0
    page.close()
    until(lambda: int(swarm.shell("k3-pi", agents)) == 0, "agents of the page still run")


def test_a_unit_that_ends_shows_at_once(swarm: LabSwarm, page: Page, promise: Promise) -> None:
    swarm.shell("k3-pi", "sudo systemctl stop swarm-newswarm.k3.service")
    began = time.monotonic()
    try:
        shown(page, "k3", "bad")
        took = time.monotonic() - began
        promise("page of swarmctl ui: from an ended driver until it shows it", took, CABLE)
    finally:
        swarm.shell("k3-pi", "sudo systemctl start swarm-newswarm.k3.service")
    expect(page.locator("#state")).to_have_text(WELL)
