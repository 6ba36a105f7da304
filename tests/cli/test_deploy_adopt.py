"""`deploy --adopt`: what it writes into the spec, and when it does not; edits are invented."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from swarmctl.adoption.adopt import Adoption, Refused
from swarmctl.cli import adopting, exit_codes
from tests.in_process import swarmctl

SPEC = """\
version: 1
name: lab
mode: leader
leader: one
ros: {distro: noetic}
hosts: {one: {address: 127.0.0.1, port: 1, user: ann}}
robots: {k3: {type: khepera3, host: one}}
links: [{kind: serial, host: one, robot: k3, usb: {serial: FTDI1234}}]
"""
LEFT = Refused("one", "launch/k3.launch", "", "lines were added or removed")


@pytest.fixture
def edited(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A spec whose comment at the end is edited on a host, beside an edit that it cannot take."""
    spec = tmp_path / "swarm.yaml"
    spec.write_text(SPEC)

    def found(*_: Any, **__: Any) -> tuple[Adoption, list[str]]:
        return Adoption({str(spec): SPEC + "# edited\n"}, refused=(LEFT,)), []

    monkeypatch.setattr(adopting, "found", found)
    return spec


@pytest.mark.parametrize("more", [[], ["--json"]])
def test_without_a_terminal_nothing_is_written(edited: Path, more: list[str]) -> None:
    found = swarmctl("deploy", str(edited), "--adopt", *more)
    assert found.returncode == exit_codes.ERROR
    assert "nothing was written or deployed" in found.stderr
    assert edited.read_text() == SPEC


@pytest.mark.parametrize(
    ("more", "fate"),
    [
        ([], "launch/k3.launch stays on the host: lines"),
        (["--overwrite-edits"], "launch/k3.launch will be overwritten (the host keeps a copy): lines"),
    ],
)
def test_yes_writes_and_each_other_edit_is_named_with_its_fate(
    edited: Path, more: list[str], fate: str
) -> None:
    found = swarmctl("deploy", str(edited), "--adopt", "--yes", *more)  # no host answers there
    assert found.returncode == exit_codes.HOSTS_UNREACHABLE, found.stderr
    assert fate in found.stderr
    assert edited.read_text().endswith("# edited\n")
