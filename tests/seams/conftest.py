"""The toys of toy.py, registered by a program or installed as another package."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from swarmctl.plugins import MIDDLEWARES, MULTIMASTERS, SECURITY_LEVELS
from swarmctl.render.middleware import Middleware
from swarmctl.render.multimaster import MultimasterProvider
from swarmctl.render.security_level import SecurityLevel
from tests import ROOT
from tests.seams.toy import MESH, PEBBLE, WATCHED

TOYS = ((MIDDLEWARES, "pebble"), (MULTIMASTERS, "mesh"), (SECURITY_LEVELS, "watched"))
SOURCES = ROOT / "tests/seams"
ENTRY_POINTS = """\
[swarmctl.middleware]
pebble = pebble_plugin:PEBBLE

[swarmctl.multimaster]
mesh = pebble_plugin:MESH

[swarmctl.security]
watched = pebble_plugin:WATCHED
"""


def install(site: Path) -> None:
    """Install the toys into ``site``, as pip would install a package of another project."""
    info = site / "pebble_plugin-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: pebble-plugin\nVersion: 1.0\n", "utf-8")
    (info / "entry_points.txt").write_text(ENTRY_POINTS, "utf-8")
    shutil.copy(SOURCES / "toy.py", site / "pebble_plugin.py")
    shutil.copytree(SOURCES / "pebble_probe", site / "pebble_probe")


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The folder in which the toys are installed, on the import path."""
    site = tmp_path / "site"
    install(site)
    monkeypatch.syspath_prepend(site)
    yield site
    sys.modules.pop("pebble_plugin", None)
    for registry, name in TOYS:
        with suppress(KeyError):  # the test did not load it
            registry.unregister(name)


@pytest.fixture(params=["register", "entry point"])
def registered(request: pytest.FixtureRequest) -> Iterator[None]:
    """Both ways in which a spec can know the toys."""
    if request.param == "entry point":
        request.getfixturevalue("installed")
        yield
        return
    middleware: Middleware = PEBBLE
    provider: MultimasterProvider = MESH
    level: SecurityLevel = WATCHED
    for (registry, name), toy in zip(TOYS, (middleware, provider, level), strict=True):
        registry.register(name, toy)
    yield
    for registry, name in TOYS:
        registry.unregister(name)
