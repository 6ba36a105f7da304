"""``swarmctl report`` of a real swarm with a pulled cable: its cause, its logs, and no secret."""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
import tarfile
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import expect

from swarmctl.cli import exit_codes
from swarmctl.lab import lab
from tests.child_process import child_process
from tests.e2e.lab_swarm import SWARMCTL, LabSwarm, until
from tests.timing import PATIENCE, Promise
from tests.ui.browser import chromium, opened


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
    swarm: LabSwarm, tmp_path: Path, operators_pin: str, promise: Promise
) -> None:
    file = tmp_path / "report.tar.gz"
    pulled = time.time()
    lab.unplug(swarm.name, "k3")
    try:
        until(lambda: "✗ device k3" in swarm.swarmctl("status").out, "status does not see the cable")
        unit = "swarm-newswarm.k3.service"
        pid = f"$(systemctl show --property MainPID --value {unit})"
        entry = f"MESSAGE=the PIN is {operators_pin}\\nOBJECT_PID={pid}\\n"
        log = f'printf "{entry}" | sudo logger --journald; sudo journalctl --unit {unit} --lines 50'
        until(lambda: operators_pin in swarm.shell("k3-pi", log), "the unit has no such entry")
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
    logged = [json.loads(line) for line in texts["logs.jsonl"].splitlines()]
    assert ("k3", "the PIN is (secret epuck-pin)") in [(one["source"], one["message"]) for one in logged]
    assert not [name for name, text in texts.items() if operators_pin in text]
    lost = [
        one["time"] for one in logged if one["source"] == "k3" and "/dev/swarm/k3 is gone" in one["message"]
    ]
    promise("logs: from a pulled cable to the time of its entry", lost[-1] - pulled, 2.0)
    shows_on_the_page(file)


def shows_on_the_page(file: Path) -> None:
    command = [str(SWARMCTL), "ui", "--from", str(file)]
    with chromium() as browser, child_process(command, stdout=subprocess.PIPE) as served:
        assert served.stdout is not None
        with opened(browser, served.stdout.readline().strip()) as page:
            expect(page.locator("#age")).to_contain_text("as of ", timeout=1000 * PATIENCE)
            page.locator("#findings button", has_text="device k3").click()
            expect(page.locator("#details")).to_contain_text("Remedy:")
            gone = page.locator("#log .level-error", has_text="/dev/swarm/k3 is gone")
            expect(gone.first).to_be_visible(timeout=1000 * PATIENCE)
        served.send_signal(signal.SIGINT)
        assert served.wait(PATIENCE) == exit_codes.OK
