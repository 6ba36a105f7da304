"""The benchmark of the start measures what a user starts, and its bar can be missed."""

from __future__ import annotations

import pytest
import startup


@pytest.mark.parametrize(("bar", "code"), [("1000", 0), ("1.01", 1)])
def test_the_exit_code_depends_on_the_bar(bar: str, code: int, capsys: pytest.CaptureFixture[str]) -> None:
    assert startup.main(["--runs", "1", "--bar", bar, "validate"]) == code
    table = capsys.readouterr().out
    assert ("over the bar" in table) == bool(code)
    for start in ("python -m swarmctl --help", "swarmctl --help", "swarmctl validate --help"):
        assert f"\n{start} " in table
