"""A check is one file: what `status` calls, and the page of all checks, follow from the modules there are."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from types import ModuleType

import pytest

from swarmctl.health import checks
from swarmctl.health.diagnosis import all_checks, diagnose
from swarmctl.health.root_cause import Finding
from tests import ROOT
from tests.health import test_driver_faults, test_host_faults, test_master_faults, test_robot_faults
from tests.health.faults import AWAY, spoilt
from tests.health.swarm_values import K3_PI, all_well, graph

A_CHECK = """
TABLE = {"boot": (("a host has booted anew", "a warning, from a file dropped in"),)}

def compare(found, context):
    from swarmctl.health.verdict import warning
    for host, answer in context.hosts:
        found.add("boot", host.name, warning(f"{context.graph.swarm} {answer.boot_id}"), host=host)
"""


@pytest.fixture
def tool() -> ModuleType:
    spec = importlib.util.spec_from_file_location("checks_page", ROOT / "tools/checks_page.py")
    assert spec is not None
    assert spec.loader is not None
    spec.loader.exec_module(module := importlib.util.module_from_spec(spec))
    return module


@pytest.fixture
def dropped_in(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """One more file lies among the checks."""
    (tmp_path / "boot.py").write_text(A_CHECK)
    monkeypatch.setattr(checks, "__path__", [*checks.__path__, str(tmp_path)])
    all_checks.cache_clear()
    yield
    all_checks.cache_clear()
    sys.modules.pop(f"{checks.__name__}.boot", None)
    with suppress(AttributeError):
        del checks.boot


def test_the_page_is_up_to_date(tool: ModuleType) -> None:
    assert (ROOT / "docs/checks.md").read_text("utf-8") == tool.page(), "run: make generated"


@pytest.mark.usefixtures("dropped_in")
def test_one_file_adds_a_check_and_its_rows(tool: ModuleType) -> None:
    boots = [one.subject for one in diagnose(graph(), all_well()).findings if one.check == "boot"]
    assert boots == [host.name for host in graph().hosts]
    assert "| `boot` | a host has booted anew | a warning, from a file dropped in |\n" in tool.page()


def diagnoses() -> list[dict[str, Finding]]:
    """The findings by key: of a healthy swarm, of hosts that are away, of each fault."""
    modules = (test_driver_faults, test_host_faults, test_master_faults, test_robot_faults)
    faults = [spoilt(fault.host, fault.spoil) for module in modules for fault in module.FAULTS.values()]
    looks = (all_well(), {**all_well(), K3_PI: AWAY}, {}, *faults)
    return [{one.key: one for one in diagnose(graph(), answers).findings} for answers in looks]


def test_every_finding_is_of_a_check_on_the_page() -> None:
    known = [name for check in all_checks() for name in check.TABLE]
    assert {one.check for found in diagnoses() for one in found.values()} <= set(known)
    assert len(set(known)) == len(known)


def test_the_order_of_checks_changes_no_finding(monkeypatch: pytest.MonkeyPatch) -> None:
    forth, backwards = diagnoses(), all_checks()[::-1]
    monkeypatch.setattr("swarmctl.health.diagnosis.all_checks", lambda: backwards)
    assert diagnoses() == forth
