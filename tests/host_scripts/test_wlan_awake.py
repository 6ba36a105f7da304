"""Wireless power saving goes off where it is on, and comes back where it was."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

from tests import ROOT

SCRIPT = ROOT / "templates/os/wlan-awake"
# Keeps the state of each interface in a file; ``stubborn`` ones cannot be switched.
IW = r"""#!/bin/sh
state=$SWARM_RADIOS/$2/state
[ "$3" = get ] && { echo "Power save: $(cat "$state")"; exit 0; }
[ -e "$SWARM_RADIOS/$2/stubborn" ] && { echo "command failed: Operation not supported (-95)" >&2; exit 161; }
echo "$5" > "$state"
"""


class Radios:
    """Wireless interfaces as folders."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.tools, self.runtime = folder / "net", folder / "bin", folder / "run"
        for one in (self.folder, self.tools, self.runtime):
            one.mkdir()

    def install_iw(self) -> None:
        (self.tools / "iw").write_text(IW)
        (self.tools / "iw").chmod(0o755)

    def add(self, name: str, state: str) -> None:
        (self.folder / name / "phy80211").mkdir(parents=True)
        (self.folder / name / "state").write_text(f"{state}\n")

    def states(self) -> dict[str, str]:
        return {one.parent.name: one.read_text().strip() for one in sorted(self.folder.glob("*/state"))}

    def run(self, verb: str) -> subprocess.CompletedProcess[str]:
        environment = {
            "PATH": f"{self.tools}:{os.environ['PATH']}",
            "SWARM_RADIOS": str(self.folder),
            "RUNTIME_DIRECTORY": str(self.runtime),
        }
        return subprocess.run(
            ["sh", SCRIPT, verb], env=environment, capture_output=True, text=True, check=False
        )


@pytest.fixture
def radios(tmp_path: Path) -> Radios:
    return Radios(tmp_path)


def test_off_where_it_was_on_and_on_again_only_there(radios: Radios) -> None:
    radios.install_iw()
    radios.add("wlan0", "on")
    radios.add("wlan1", "off")
    assert radios.run("off").returncode == 0
    assert radios.states() == {"wlan0": "off", "wlan1": "off"}
    assert radios.run("restore").returncode == 0
    assert radios.states() == {"wlan0": "on", "wlan1": "off"}


def test_a_radio_that_cannot_is_named_and_holds_up_no_other(radios: Radios) -> None:
    radios.install_iw()
    radios.add("wlan0", "on")
    (radios.folder / "wlan0/stubborn").touch()
    radios.add("wlan1", "on")
    ran = radios.run("off")
    assert ran.returncode == 0
    assert "wlan0 cannot be switched off" in ran.stderr
    assert radios.states() == {"wlan0": "on", "wlan1": "off"}


def test_a_host_without_radio_or_without_iw_starts_all_the_same(radios: Radios) -> None:
    assert radios.run("restore").returncode == 0
    radios.install_iw()
    assert radios.run("off").returncode == 0
    assert radios.run("restore").returncode == 0
