"""A Chromium that opens the page as people do; what it complains of, and whom else it asks, is kept."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Browser, Page, expect, sync_playwright

from tests.timing import PATIENCE

NAMES = ("chromium", "chromium-browser", "google-chrome")
WIDE, PHONE = (1280, 860), (375, 740)  # px


@contextmanager
def chromium() -> Iterator[Browser]:
    """A browser for some pages; skips the test where none is installed."""
    program = next(filter(None, map(shutil.which, NAMES)), None)
    if program is None:
        pytest.skip("needs Chromium: apt install chromium")
    expect.set_options(timeout=1000 * PATIENCE)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        yield browser
        browser.close()


@contextmanager
def opened(browser: Browser, url: str, size: tuple[int, int] = WIDE) -> Iterator[Page]:
    """The page at ``url``. Fails at the end if it has complained, or has sent a request to another server."""
    complaints: list[str] = []
    page = browser.new_page(viewport={"width": size[0], "height": size[1]})
    page.set_default_timeout(1000 * PATIENCE)
    page.on("console", lambda one: complaints.append(one.text) if one.type in ("error", "warning") else None)
    page.on("pageerror", lambda one: complaints.append(str(one)))
    page.on("request", lambda one: complaints.append(one.url) if foreign(one.url, url) else None)
    page.on("websocket", lambda one: complaints.append(one.url) if foreign(one.url, url) else None)
    page.goto(url)
    yield page
    page.close()
    assert complaints == []


def foreign(one: str, own: str) -> bool:
    return not one.startswith("data:") and urlsplit(one).netloc != urlsplit(own).netloc
