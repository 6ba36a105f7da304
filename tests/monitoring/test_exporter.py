"""``swarmctl exporter`` and ``status --metrics``: what they serve and write, with hosts that are made up."""

from __future__ import annotations

import socket
import stat
import sys
import threading
import urllib.request
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from swarmctl.cli.where import Where
from swarmctl.health import collect as asking
from swarmctl.remote.transport import Target
from tests.health.swarm_values import all_well, graph
from tests.ports import free_port

Probe = Callable[[], dict[str, Any]]


@pytest.fixture
def probed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[Probe]:
    """The looks at the hosts, each a function; then Ctrl-C."""
    rounds: list[Probe] = []
    monkeypatch.chdir(tmp_path)

    def probe_hosts(*_: Any, **__: Any) -> dict[str, Any]:
        if not rounds:
            raise KeyboardInterrupt
        return rounds.pop(0)()

    monkeypatch.setattr(asking, "probe_hosts", probe_hosts)
    reach = {host.name: Target(host.name, host.address, "robot") for host in graph().hosts}
    monkeypatch.setattr(Where, "targets", lambda *_, **__: reach)
    return rounds


def scraped(port: int) -> str:
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/metrics") as answer:
        return str(answer.read().decode())


def test_a_scrape_gets_the_last_look_while_the_next_one_runs(probed: list[Probe], leader_spec: Path) -> None:
    port, seen = free_port(), []

    def look() -> dict[str, Any]:
        seen.extend([scraped(port), scraped(port)])
        return all_well()

    probed.extend([look, look])
    command = ["exporter", str(leader_spec), "--listen", f"127.0.0.1:{port}", "--every", "1"]
    threads = threading.active_count()
    assert run(command) == exit_codes.OK
    before, _, first, again = seen
    assert "swarm_" not in before
    assert 'swarm_host_up{host="k3-pi",swarm="newswarm"} 1.0' in first
    assert first == again
    assert probed == []
    assert threading.active_count() == threads
    with socket.socket() as one:
        assert one.connect_ex(("127.0.0.1", port)) != 0


def test_a_port_in_use_is_one_line(
    probed: list[Probe], leader_spec: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        taken = f"127.0.0.1:{other.getsockname()[1]}"
        assert run(["exporter", str(leader_spec), "--listen", taken]) == exit_codes.ERROR
    assert capsys.readouterr().err.startswith(f"error: --listen {taken}: Address already in use\n")


@pytest.mark.parametrize("listen", ["9842", "pi", ":9842", "pi:0", "pi:65536", "a@pi:9842", "pi:9842/x", ""])
def test_a_wrong_address_is_a_usage_error(
    probed: list[Probe], leader_spec: Path, listen: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["exporter", str(leader_spec), "--listen", listen]) == exit_codes.USAGE
    assert f"`{listen}` is no address to listen at" in capsys.readouterr().err


def test_an_address_of_another_machine_is_an_error(
    probed: list[Probe], leader_spec: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["exporter", str(leader_spec), "--listen", "192.0.2.1:9842"]) == exit_codes.ERROR
    assert "--listen 192.0.2.1:9842: Cannot assign requested address" in capsys.readouterr().err


@pytest.mark.parametrize("words", [["exporter"], ["status", "--metrics", "x.prom"]], ids=" ".join)
def test_without_the_library_no_host_is_contacted(
    probed: list[Probe],
    leader_spec: Path,
    words: list[str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    probed.append(all_well)
    monkeypatch.setitem(sys.modules, "prometheus_client", None)
    assert run([words[0], str(leader_spec), *words[1:]]) == exit_codes.USAGE
    assert len(probed) == 1
    shown = capsys.readouterr().err
    assert "needs prometheus_client, which is not installed" in shown
    assert "pip install 'swarmctl[metrics]'" in shown


def test_status_writes_a_file_that_others_can_read(
    probed: list[Probe], leader_spec: Path, tmp_path: Path
) -> None:
    file = tmp_path / "swarm.prom"
    probed.append(all_well)
    run(["status", str(leader_spec), "--metrics", str(file)])
    assert stat.S_IMODE(file.stat().st_mode) == 0o644
    assert 'swarm_host_up{host="k3-pi",swarm="newswarm"} 1.0' in file.read_text()
    assert [*tmp_path.iterdir()] == [file]


def test_watching_writes_the_file_each_round(probed: list[Probe], leader_spec: Path, tmp_path: Path) -> None:
    file, written = tmp_path / "swarm.prom", []

    def look() -> dict[str, Any]:
        written.append(file.exists())
        return all_well()

    probed.extend([look, look])
    watching = ["status", str(leader_spec), "--watch", "--every", "1", "--metrics", str(file)]
    assert run(watching) == exit_codes.OK
    assert written == [False, True]


def test_a_file_that_cannot_be_written_costs_no_status(
    probed: list[Probe], leader_spec: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    probed.append(all_well)
    command = ["status", str(leader_spec), "--metrics", str(tmp_path / "no/x.prom")]
    assert run(command) == exit_codes.ERROR
    shown = capsys.readouterr()
    assert "newswarm" in shown.out
    assert "cannot write" in shown.err
