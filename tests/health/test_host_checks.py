"""The checks of a host itself: their page, and what a host may report for them."""

from __future__ import annotations

import importlib.util
from typing import Any

import pytest

from swarmctl.health.host_checks import host_checks
from swarmctl.health.probe_answer import answer_of
from swarmctl.remote.transport import HostError, Kind
from tests import ROOT

MEMORY = {"size": 1024, "available": 512}


def test_the_page_is_up_to_date() -> None:
    spec = importlib.util.spec_from_file_location("host_checks_page", ROOT / "tools/host_checks_page.py")
    assert spec is not None
    assert spec.loader is not None
    spec.loader.exec_module(tool := importlib.util.module_from_spec(spec))
    assert (ROOT / "docs/host-checks.md").read_text("utf-8") == tool.page(), "run: make generated"


def test_what_a_host_reports_has_the_type_of_its_check() -> None:
    found = answer_of({"checks": {"memory": [MEMORY], "of a newer agent": [1]}}).checks
    assert found["memory"] == (host_checks()["memory"].Seen(1024, 512),)
    assert not found["of a newer agent"]


@pytest.mark.parametrize("lie", [[{**MEMORY, "size": "much"}], [{"size": 1}], {"size": 1}, [None]])
def test_a_host_that_lies_is_refused(lie: Any) -> None:
    with pytest.raises(HostError, match="what the host observed for `memory` does not fit") as found:
        answer_of({"checks": {"memory": lie}})
    assert found.value.kind is Kind.PROTOCOL
