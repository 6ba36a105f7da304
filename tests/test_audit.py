"""``make audit``: what no service checked is never without known vulnerabilities."""

from __future__ import annotations

from typing import Any

import pytest

from tools.audit import UNCHECKED, VULNERABLE, verdict

SOUND: dict[str, Any] = {"name": "rich", "version": "15.0.0", "vulns": []}
FAULTY: dict[str, Any] = {
    "name": "jinja2",
    "version": "3.1.5",
    "vulns": [{"id": "CVE-1", "fix_versions": ["3.1.6"]}],
}
SKIPPED: dict[str, Any] = {"name": "pint", "skip_reason": "Dependency not found: pint (0.25.3)"}


@pytest.mark.parametrize(
    ("packages", "code", "lines"),
    [
        ([SOUND], 0, ["1 packages: no known vulnerabilities"]),
        ([SOUND, FAULTY], VULNERABLE, ["jinja2 3.1.5: CVE-1, fixed in 3.1.6"]),
        (
            [FAULTY, SKIPPED],
            UNCHECKED,
            ["jinja2 3.1.5: CVE-1, fixed in 3.1.6", "not checked: Dependency not found: pint (0.25.3)"],
        ),
        (
            [SKIPPED],
            UNCHECKED,
            ["nothing was checked: the vulnerability service has none of the packages"],
        ),
        ([], UNCHECKED, ["nothing was checked: the vulnerability service has none of the packages"]),
    ],
)
def test_what_was_not_checked_fails(packages: list[dict[str, Any]], code: int, lines: list[str]) -> None:
    assert verdict({"dependencies": packages}) == (code, lines)
