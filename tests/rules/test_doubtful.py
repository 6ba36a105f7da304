"""Every doubtful spec is taken, with its warning word for word: it may work, and people lost days over it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from tests.rules.specs import DOUBTFUL, specs_in

SPECS = specs_in(DOUBTFUL)


@pytest.mark.parametrize("spec", SPECS, ids=lambda spec: spec.stem)
def test_warning(
    spec: Path,
    golden: Callable[[Path, str], None],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(spec.parent)
    monkeypatch.delenv("FORCE_COLOR", raising=False)
    monkeypatch.setenv("NO_COLOR", "1")
    assert run(["validate", spec.name]) == exit_codes.OK
    printed = capsys.readouterr()
    assert printed.err.startswith("warning[")
    golden(spec.with_suffix(".txt"), printed.err)


def test_no_warning_is_left_over() -> None:
    assert {file.stem for file in DOUBTFUL.glob("*/*.txt")} == {spec.stem for spec in SPECS}
