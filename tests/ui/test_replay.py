"""The replay of a recorded run: from bags, through the command, to what people see in a real browser."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect

from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from swarmctl.health import report_archive, swarm_health
from swarmctl.health.diagnosis import diagnose
from swarmctl.health.host_logs import Entry
from tests import ROOT
from tests.child_process import child_process
from tests.health.swarm_values import EXAMPLE, all_well, graph, with_device
from tests.ui.bag_files import BEGAN, battery, command, odometry, write
from tests.ui.browser import PHONE, chromium, opened
from tests.ui.test_page import example

SECONDS = 120  # of the run, in which the Koala drives 0.1 m/s along x


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as found:
        yield found


@pytest.fixture(scope="module")
def bags(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run in two bags, the battery a little less every second."""
    folder = tmp_path_factory.mktemp("bags")
    times = [number / 10 for number in range(10 * SECONDS)]
    recorded: list[Any] = []
    for time in times:
        recorded += [(time, *odometry(time / 10, speed=0.1)), (time, *command(0.1))]
        if time == int(time):
            recorded.append((time, *battery(0.9 - time / 200)))
    half = len(recorded) // 2
    write(folder / "koala-laptop_0.bag", recorded[:half])
    write(folder / "koala-laptop_1.bag", recorded[half:])
    return folder


@contextmanager
def replayed(*words: str) -> Iterator[str]:
    """The URL that `swarmctl ui` prints."""
    program = [sys.executable, "-m", "swarmctl", "ui", *words]
    with child_process(program, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as ui:
        assert ui.stdout is not None
        yield ui.stdout.readline().strip()


@pytest.fixture(scope="module")
def url(bags: Path) -> Iterator[str]:
    with replayed(str(EXAMPLE), "--bags", str(bags)) as found:
        yield found


@pytest.fixture
def page(browser: Browser, url: str) -> Iterator[Page]:
    with opened(browser, url) as found:
        found.get_by_role("button", name="Arena").click()
        yield found


def go(page: Page, seconds: float) -> None:
    """Moves the slider."""
    page.locator("#slider").fill(str(round(1000 * (BEGAN + seconds))))


def place(page: Page) -> float:
    """The x of the Koala in the arena, from where it began, m."""
    x: float = page.evaluate("trails().get('koala').at(-1)[0] - places.get('koala')[0]")
    return round(x, 3)


def test_the_slider_moves_the_robot(page: Page) -> None:
    assert place(page) == 0.01
    go(page, 12.1)
    assert place(page) == 1.21
    expect(page.locator("#time")).to_have_text(re.compile(r"\d\d:\d\d:55\.1"))
    expect(page.locator("#slider")).to_have_attribute("aria-valuetext", re.compile(r":55\.1"))
    page.get_by_role("button", name="Graph").click()
    page.locator('[data-id="robot:koala"]').click()
    expect(page.locator("#details")).to_contain_text("battery 84 %")
    assert page.evaluate("plot.data.map((one) => one.at(-1))") == [0, 0.1, 0.1, 0, 0]
    go(page, 2.1)
    expect(page.locator("#details")).to_contain_text("battery 89 %")
    expect(page.locator("#state")).to_have_text("a recorded run")


def test_at_any_time_the_pose_is_the_last_that_was_recorded(page: Page) -> None:
    """A bag has a pose every 0.1 s; the page has every second one, the later one of each 0.2 s."""
    for seconds in (1.0, 117.3, 40.5, 59.9, 60.1, 1.2, *range(100, 0, -9)):
        go(page, seconds)
        shown, at = page.evaluate("[shownTime, robots.get('koala').at]")
        recorded = page.evaluate("run.get('koala').map((one) => one.at)")
        assert at == max(one for one in recorded if one <= shown)
        assert math.isclose(place(page), (at / 1000 - BEGAN) / 10, abs_tol=0.002)


def test_play_goes_on_to_the_end_and_begins_again(page: Page) -> None:
    go(page, SECONDS - 1)
    assert page.evaluate("(button.click(), button.textContent)") == "Pause"
    expect(page.get_by_role("button", name="Play")).to_be_visible()
    assert place(page) == SECONDS / 10 - 0.01
    assert page.evaluate("(button.click(), shownTime === first)")
    page.wait_for_function("shownTime > first")
    page.get_by_role("button", name="Pause").click()
    before = page.evaluate("shownTime")
    page.wait_for_timeout(200)
    assert page.evaluate("shownTime") == before


def test_the_keyboard_alone_plays_and_moves(page: Page) -> None:
    page.locator("#slider").focus()
    for _ in range(5):
        page.keyboard.press("ArrowRight")
    assert page.evaluate("shownTime - first") == 1000
    page.keyboard.press("ArrowLeft")
    assert page.evaluate("shownTime - first") == 800
    page.keyboard.press("Shift+Tab")
    page.keyboard.press("Space")
    expect(page.get_by_role("button", name="Pause")).to_be_visible()
    page.wait_for_function("shownTime - first > 800")
    page.keyboard.press("Enter")
    expect(page.get_by_role("button", name="Play")).to_be_visible()
    assert page.evaluate("shownTime - first") > 800


def test_it_fits_a_phone(browser: Browser, url: str) -> None:
    with opened(browser, url, PHONE) as page:
        go(page, 5.0)
        expect(page.locator("#slider")).to_be_in_viewport()
        assert page.evaluate("document.documentElement.scrollWidth") <= PHONE[0]
        page.get_by_role("button", name="Arena").click()
        assert page.evaluate("document.documentElement.scrollWidth") <= PHONE[0]


def test_a_report_has_its_findings_and_logs_beside_the_run(
    browser: Browser, bags: Path, tmp_path: Path
) -> None:
    outcomes = all_well()
    outcomes["koala-laptop"] = with_device("koala", exists=False)(outcomes["koala-laptop"])
    status = swarm_health.status(graph(), outcomes, diagnose(graph(), outcomes))
    topics = {"koala": {"odometry": "/koala/odom", "command": "/koala/cmd_vel", "battery": ""}}
    documents = {
        report_archive.STATUS: status.to_json(),
        report_archive.LOOK: {"began": BEGAN, "took": 1.0, "spec": [], "where": []},
        report_archive.GRAPH: example().to_json(),
        report_archive.LOGS: asdict(Entry(BEGAN, "koala-laptop", "koala", "error", "the cable is loose")),
        report_archive.MOTION: {"topics": topics, "starts": {"koala": [5.0, 0.0, 0.0]}},
    }
    archive = tmp_path / "r.tar.gz"
    texts = {name: json.dumps(document) for name, document in documents.items()}
    archive.write_bytes(report_archive.packed("r", texts, BEGAN))
    with replayed("--from", str(archive), "--bags", str(bags)) as url, opened(browser, url) as page:
        go(page, 12.1)
        page.locator("#findings button", has_text="device").click()
        expect(page.locator("#details h2")).to_have_text("koala robot, koala")
        expect(page.locator("#details")).to_contain_text("0.10 m/s")
        expect(page.locator("#log")).to_contain_text("the cable is loose")
        expect(page.locator("#age")).to_contain_text("as of")
        page.get_by_role("button", name="Arena").click()
        assert page.evaluate("trails().get('koala').at(-1)[0]") == pytest.approx(6.21)


def test_nothing_is_connected_to(bags: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for word in ("--control", "--lab"):
        assert run(["ui", str(EXAMPLE), "--bags", str(bags), word]) == exit_codes.USAGE
        assert "connects to no host" in capsys.readouterr().err


def test_a_folder_without_the_run_is_an_error(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "bags"
    assert run(["ui", str(EXAMPLE), "--bags", str(folder)]) == exit_codes.ERROR
    assert capsys.readouterr().err == f"reading {folder} ...\nerror: {folder}: No such file or directory\n"
    folder.mkdir()
    write(folder / "a.bag", [(0.0, *odometry(0.0, robot="other"))])
    (folder / "b.bag").write_text("no bag")
    assert run(["ui", str(EXAMPLE), "--bags", str(folder)]) == exit_codes.ERROR
    assert capsys.readouterr().err == (
        f"reading {folder} ...\n"
        f"warning: {folder}/b.bag is not shown: it is damaged, or no bag\n"
        f"error: {folder} has no bag with a topic of a robot of the swarm\n"
    )
