"""``swarmctl report`` of a real swarm with a pulled cable: its cause, its logs, and no secret."""

from __future__ import annotations

import shutil
import tarfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from swarmctl.lab import lab
from tests.e2e.lab_swarm import LabSwarm, until


@pytest.fixture
def operators_pin(swarm: LabSwarm) -> Iterator[str]:
    """The PIN of the e-puck, as the operator has it in a file."""
    file = swarm.spec.parent / "secrets/epuck-pin"
    file.parent.mkdir(exist_ok=True)
    file.touch(0o600)
    file.write_text("2846#17x")
    yield "2846#17x"
    shutil.rmtree(file.parent)


def test_a_report_has_the_cause_and_the_logs_and_no_secret(
    swarm: LabSwarm, tmp_path: Path, operators_pin: str
) -> None:
    file = tmp_path / "report.tar.gz"
    lab.unplug(swarm.name, "k3")
    try:
        until(lambda: "✗ device k3" in swarm.swarmctl("status").out, "status does not see the cable")
        pid = "$(systemctl show --property MainPID --value swarm-newswarm.k3.service)"
        entry = f"MESSAGE=the PIN is {operators_pin}\\nOBJECT_PID={pid}\\n"
        swarm.shell("k3-pi", f'printf "{entry}" | sudo logger --journald')
        written = swarm.swarmctl("report", "-o", str(file))
    finally:
        lab.plug(swarm.name, "k3")
    assert written.status == exit_codes.OK, written.out
    shown = swarm.run("status", "--from", str(file))
    assert shown.status == exit_codes.UNHEALTHY
    assert "✗ device k3" in shown.out
    with tarfile.open(file) as tar:
        texts = {
            one.name.partition("/")[2]: content.read().decode()
            for one in tar
            if (content := tar.extractfile(one)) is not None
        }
    assert "the PIN is (secret epuck-pin)" in texts["logs.jsonl"]
    assert not [name for name, text in texts.items() if operators_pin in text]
