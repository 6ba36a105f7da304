"""The page in a real browser, with statuses and motion that are made up: what people see and do there."""

from __future__ import annotations

import http.client
import math
import re
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Browser, Page, expect

from swarmctl.analysis.diagram import Diagram, Edge, Node, diagram
from swarmctl.health import swarm_health
from swarmctl.health.diagnosis import diagnose
from swarmctl.health.host_logs import Entry
from swarmctl.remote.transport import HostError, Kind
from swarmctl.swarm.index import SwarmIndex
from swarmctl.ui import messages
from swarmctl.ui.server import Pages, serving
from swarmctl.views.graph import page as pages_view
from tests.health.swarm_values import EXAMPLE, all_well, graph, no_serial_port
from tests.loading import load_checked
from tests.timing import PATIENCE, Promise, wait_for
from tests.ui.browser import PHONE, chromium, opened

FRAMES = 30  # a second
NASTY = '<img src=x onerror="alert(1)"></script>'


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as found:
        yield found


@contextmanager
def served(shown: Diagram | None = None, *, control: bool = False) -> Iterator[tuple[str, Pages]]:
    pages = Pages(("log", "stop", "start") if control else ("log",))
    live = pages_view.Live({"koala": (1.0, 0.5, math.pi / 2)}, control)
    with serving(pages_view.graph(shown or example(), live), pages, 0) as url:
        yield url, pages


def example() -> Diagram:
    document, _ = load_checked(EXAMPLE)
    assert document is not None
    return diagram(SwarmIndex(document))


def well() -> dict[str, Any]:
    return status(all_well())


def status(outcomes: dict[str, Any]) -> dict[str, Any]:
    seen = swarm_health.status(graph(), outcomes, diagnose(graph(), outcomes))
    return messages.status(seen, 0.0)


def without_cable() -> dict[str, Any]:
    outcomes = all_well()
    outcomes["k3-pi"] = no_serial_port("k3")(outcomes["k3-pi"])
    outcomes["epuck-pi"] = HostError(Kind.UNREACHABLE, "no answer at 10.0.0.4:22")
    return status(outcomes)


def report(**changes: Any) -> dict[str, Any]:
    return {
        "pose": [0.0, 0.0, 0.0], "driven": [0.0, 0.0], "commanded": [0.0, 0.0], "commander": "nobody",
        "trouble": "", "held": False, "battery": 0.8, **changes,
    }  # fmt: skip


@pytest.fixture
def shown(browser: Browser) -> Iterator[tuple[Page, Pages]]:
    with served() as (url, pages), opened(browser, url) as page:
        wait_for(pages.opened.is_set)
        yield page, pages


def node(page: Page, name: str) -> Any:
    return page.locator(f'[data-id="{name}"]')


def test_it_loads_with_the_graph_and_waits_for_the_health(browser: Browser, promise: Promise) -> None:
    with served() as (url, pages):
        began = time.monotonic()
        with opened(browser, url) as page:
            expect(node(page, "robot:k3")).to_be_visible()
            promise("page of swarmctl ui, until it shows the graph", time.monotonic() - began, 2.0)
            expect(page.locator("#state")).to_have_text("looking at the hosts ...")
            wait_for(pages.opened.is_set)
            pages.send("status", well())
            expect(page.locator("#state")).to_have_text("healthy")
            expect(page.locator("#no-findings")).to_be_visible()
        wait_for(lambda: not pages.opened.is_set())


def test_a_state_has_a_shape_and_a_name_beside_its_colour(shown: tuple[Page, Pages]) -> None:
    page, pages = shown
    pages.send("status", without_cable())
    expect(page.locator("#state")).to_contain_text("not healthy")
    expect(node(page, "robot:k3")).to_have_attribute("aria-label", "robot k3, khepera3: bad")
    expect(node(page, "robot:koala")).to_have_attribute("aria-label", "robot koala, koala: ok")
    expect(node(page, "robot:epuck")).to_have_attribute("aria-label", "robot epuck, epuck: unknown")
    names = ("koala", "k3", "epuck")
    marks = [node(page, f"robot:{name}").locator(".badge").get_attribute("d") for name in names]
    assert len(set(marks)) == len(names)


def test_a_finding_leads_to_its_robot_with_cause_symptoms_and_remedy(shown: tuple[Page, Pages]) -> None:
    page, pages = shown
    pages.send("status", without_cable())
    page.locator("#findings button", has_text="device").click()
    details = page.locator("#details")
    expect(details.locator("h2")).to_have_text("k3 robot, khepera3")
    expect(details).to_contain_text("Remedy:")
    expect(details).to_contain_text("Symptoms:")
    expect(details).to_contain_text("/k3/odom")
    expect(node(page, "robot:k3")).to_have_attribute("aria-pressed", "true")


def test_a_trial_shows_its_countdown_while_hosts_report_it(shown: tuple[Page, Pages]) -> None:
    page, pages = shown
    expect(page.locator("#trial")).to_be_hidden()
    pages.send("telemetry", {"robots": {}, "missing": [], "trial": "circles, trial 3", "left": 34.0})
    pages.send("telemetry", {"robots": {}, "missing": [], "trial": "", "left": 0.0})
    expect(page.locator("#trial")).to_have_text(re.compile("^circles, trial 3: 3[34] s left$"))
    expect(page.locator("#trial")).to_be_hidden()


def test_the_keyboard_alone_is_enough(shown: tuple[Page, Pages]) -> None:
    page, pages = shown
    pages.send("status", well())
    expect(page.locator("#state")).to_have_text("healthy")
    node(page, "host:koala-laptop").focus()
    for key, name in (
        ("ArrowDown", "robot:koala"),
        ("ArrowDown", "host:epuck-pi"),
        ("ArrowDown", "robot:epuck"),
    ):
        page.keyboard.press(key)
        assert page.evaluate("document.activeElement.dataset.id") == name
    page.keyboard.press("Enter")
    expect(page.locator("#details h2")).to_have_text("epuck robot, epuck")
    page.keyboard.press("Escape")
    expect(page.locator("#details")).to_have_text("Select a host, robot, program or network.")
    page.get_by_role("button", name="Arena").focus()
    page.keyboard.press("Enter")
    expect(page.locator("#arena")).to_be_visible()


def test_it_fits_a_phone(browser: Browser) -> None:
    with served(control=True) as (url, pages), opened(browser, url, PHONE) as page:
        wait_for(pages.opened.is_set)
        pages.send("status", without_cable())
        expect(page.locator("#state")).to_contain_text("not healthy")  # the picture moves down for it
        pages.send("telemetry", {"robots": {"k3": report()}, "missing": []})
        node(page, "robot:k3").click()
        expect(page.locator("#plot canvas")).to_be_visible()
        assert page.evaluate("document.documentElement.scrollWidth") <= PHONE[0]
        page.get_by_role("button", name="Arena").click()
        assert page.evaluate("document.documentElement.scrollWidth") <= PHONE[0]


def test_what_a_robot_reports_shows_before_the_next_look(shown: tuple[Page, Pages]) -> None:
    page, pages = shown
    pages.send("status", well())
    expect(page.locator("#state")).to_have_text("healthy")
    pages.send("telemetry", {"robots": {"k3": report(trouble="no answer")}, "missing": []})
    expect(page.locator("#state")).to_have_text("k3: no answer")
    expect(node(page, "robot:k3")).to_have_attribute("aria-label", "robot k3, khepera3: unknown")
    pages.send("telemetry", {"robots": {"k3": report(), "epuck": report()}, "missing": ["epuck"]})
    expect(page.locator("#state")).to_have_text("epuck: its device is missing")
    pages.send("telemetry", {"robots": {"k3": report(), "epuck": report()}, "missing": []})
    expect(page.locator("#state")).to_have_text("healthy")


def test_a_look_that_finds_nothing_decides(shown: tuple[Page, Pages]) -> None:
    page, pages = shown
    pages.send("status", well())
    pages.send("telemetry", {"robots": {"k3": report(trouble="no odometry")}, "missing": []})
    expect(node(page, "robot:k3")).to_have_attribute("data-state", "unknown")
    pages.send("status", well())
    # The robot goes on to report it.
    pages.send("telemetry", {"robots": {"k3": report(trouble="no odometry", battery=0.5)}, "missing": []})
    node(page, "robot:k3").click()
    expect(page.locator("#details")).to_contain_text("battery 50 %")
    expect(node(page, "robot:k3")).to_have_attribute("data-state", "ok")
    expect(page.locator("#state")).to_have_text("healthy")


def test_a_warning_gives_way_to_a_new_trouble_until_a_look(shown: tuple[Page, Pages]) -> None:
    page, pages = shown
    warned = well()
    for host in warned["status"]["hosts"]:
        for robot in host["robots"]:
            robot["state"] = "warning" if robot["name"] == "k3" else robot["state"]
    pages.send("status", warned)
    expect(node(page, "robot:k3")).to_have_attribute("data-state", "warning")
    pages.send("telemetry", {"robots": {"k3": report(trouble="no answer")}, "missing": []})
    expect(node(page, "robot:k3")).to_have_attribute("data-state", "unknown")
    pages.send("status", warned)  # of a robot that is optional
    expect(node(page, "robot:k3")).to_have_attribute("data-state", "warning")


def test_a_page_without_its_server_says_so(browser: Browser) -> None:
    page = browser.new_page()  # which complains of connections that fail
    with served() as (url, pages):
        page.goto(url)
        wait_for(pages.opened.is_set)
        pages.send("status", well())
        expect(page.locator("#age")).to_contain_text("seen")
        page.context.set_offline(True)
        page.evaluate("connection.close()")
        expect(page.locator("#age")).to_contain_text("OUT OF DATE")
        page.context.set_offline(False)
        expect(page.locator("#age")).not_to_contain_text("OUT OF DATE")
        page.close()


def test_the_arena_shows_poses_in_the_map_and_a_click_selects(shown: tuple[Page, Pages]) -> None:
    page, pages = shown
    page.get_by_role("button", name="Arena").click()
    robots = {"koala": report(pose=[1.0, 0.0, 0.0]), "k3": report(), "epuck": report(pose=[0.0, 3.0, 0.0])}
    pages.send("telemetry", {"robots": robots, "missing": []})
    wait_for(lambda: page.evaluate("trails().size") == len(robots), interval=0.05)
    # It looks along y from (1, 0.5), so that 1 m ahead is (1, 1.5).
    place = page.evaluate("inMap('koala', [1, 0, 0]).map((one) => Number(one.toFixed(6)))")
    assert place == [1.0, 1.5, 1.570796]
    assert "koala" not in page.locator("#placeless").inner_text()
    place = page.evaluate("(([s, x, y]) => [x + s * 1.0, y - s * 1.5])(fitted(trails()))")
    page.locator("#arena canvas").click(position={"x": place[0], "y": place[1]})
    expect(page.locator("#details h2")).to_have_text("koala robot, koala")
    expect(page.locator("#details")).to_contain_text("battery 80 %")


def test_sixty_robots_move_smoothly(browser: Browser, promise: Promise) -> None:
    robots = [Node("robot", f"r{number}", "epuck", "lab") for number in range(60)]
    hosts = [Node("host", f"h{number}", "pi", "lab") for number in range(60)]
    edges = [Edge("serial", host.id, robot.id, "usb") for host, robot in zip(hosts, robots, strict=True)]
    swarm = Diagram("many", "leader", (("lab", "h0"),), (*hosts, *robots), tuple(edges))
    with served(swarm) as (url, pages), opened(browser, url) as page:
        wait_for(pages.opened.is_set)
        page.get_by_role("button", name="Arena").click()

        def feed(turns: int) -> float:
            before, began = frames(page), time.monotonic()
            for turn in range(turns):
                for number, robot in enumerate(robots):
                    pose = [math.sin(turn / 10) + number % 10, number / 10, turn / 10]
                    pages.send("telemetry", {"robots": {robot.name: report(pose=pose)}, "missing": []})
                page.wait_for_timeout(200)
            return (time.monotonic() - began) / max(1, frames(page) - before)

        feed(10)
        took = feed(15)
        assert page.evaluate("trails().size") == len(robots)
    promise("page of swarmctl ui, 60 robots at 5 Hz each: s from frame to frame", took, 1 / FRAMES)


def frames(page: Page) -> int:
    return int(page.locator("#arena canvas").get_attribute("data-frames") or 0)


def test_buttons_are_there_with_control_alone(browser: Browser) -> None:
    with served() as (url, pages), opened(browser, url) as page:
        wait_for(pages.opened.is_set)
        assert page.locator("[data-action]").count() == 0
        page.evaluate("ask('stop', [])")
        pages.send("status", well())
        expect(page.locator("#state")).to_have_text("healthy")
        assert pages.requests.empty()
    with served(control=True) as (url, pages), opened(browser, url) as page:
        wait_for(pages.opened.is_set)
        page.get_by_role("button", name="Stop all robots").click()
        assert pages.requests.get(timeout=PATIENCE) == ("stop", [])
        node(page, "robot:k3").click()
        page.get_by_role("button", name="Release it").click()
        assert pages.requests.get(timeout=PATIENCE) == ("log", ["robot:k3"])
        assert pages.requests.get(timeout=PATIENCE) == ("start", ["k3"])
        pages.send("result", {"text": "k3  stands: by its wheels, 0.12 s after the command"})
        expect(page.locator("#results")).to_have_text("k3  stands: by its wheels, 0.12 s after the command")


def test_a_robot_shows_its_log(shown: tuple[Page, Pages]) -> None:
    page, pages = shown
    pages.send("status", well())
    node(page, "robot:k3").click()
    assert pages.requests.get(timeout=PATIENCE) == ("log", ["robot:k3"])
    pages.send(
        "log", messages.log("robot:koala", [Entry(0.0, "koala-laptop", "koala", "info", "of another")])
    )
    pages.send("log", messages.log("robot:k3", [Entry(0.0, "k3-pi", "k3", "error", "no answer")]))
    expect(page.locator("#log .level-error")).to_contain_text("k3  error  no answer")
    expect(page.locator("#log > *")).to_have_count(1)
    page.get_by_role("button", name="Reload").click()
    assert pages.requests.get(timeout=PATIENCE) == ("log", ["robot:k3"])


def test_no_name_or_message_is_html(browser: Browser) -> None:
    swarm = Diagram(NASTY, "leader", (), (Node("host", NASTY, NASTY),), ())
    with served(swarm, control=True) as (url, pages), opened(browser, url) as page:
        wait_for(pages.opened.is_set)
        pages.send("result", {"text": NASTY})
        expect(page.locator("#results")).to_have_text(NASTY)
        node(page, f"host:{NASTY}".replace('"', '\\"')).click()
        expect(page.locator("#details h2")).to_contain_text(NASTY)
        assert page.locator("img").count() == 0


@pytest.mark.parametrize(
    ("change", "host", "answer"),
    [
        (lambda path: path, "localhost:1", 200),
        (lambda path: path[:-1], "127.0.0.1", 403),
        (lambda path: "/", "127.0.0.1", 403),
        (lambda path: path, "lab.example", 400),
    ],
)
def test_only_the_url_that_was_printed_is_served(
    change: Callable[[str], str], host: str, answer: int
) -> None:
    with served() as (url, _):
        place = urlsplit(url)
        connection = http.client.HTTPConnection(place.netloc)
        for path in (f"{place.path}?{place.query}", f"/live?{place.query}"):
            upgrade = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13",
                       "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA=="} if "live" in path else {}  # fmt: skip
            connection.request("GET", change(path), headers={"Host": host, **upgrade})
            found = connection.getresponse()
            found.read()
            assert found.status == (101 if upgrade and answer == 200 else answer)
            connection.close()


def test_a_port_in_use_is_an_error() -> None:
    with served() as (url, _), pytest.raises(OSError, match="in use"), serving("", Pages(), port_of(url)):
        pass


def port_of(url: str) -> int:
    return urlsplit(url).port or 0
