"""What `adopt` prints of the files of hosts."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.adoption.adopt import Adoption
from swarmctl.cli import adopting


def test_a_file_of_a_host_cannot_steer_the_terminal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    script = tmp_path / "follow.py"
    script.write_text("speed = 1\n")

    adopting.show(Adoption({str(script): "speed = 2  # \x1b]52;c;cm0=\x07\x1b[2J\n"}))

    printed = capsys.readouterr().out
    assert "-speed = 1\n" in printed
    assert "+speed = 2  # \\x1b]52;c;cm0=\\x07\\x1b[2J\n" in printed
