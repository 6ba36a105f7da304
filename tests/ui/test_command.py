"""The command line of `swarmctl ui`, where it does not come to a page."""

from __future__ import annotations

import importlib.util
import socket
from pathlib import Path
from queue import SimpleQueue
from threading import Event
from typing import Any, NoReturn

import pytest

from swarmctl.cli import exit_codes, extras
from swarmctl.cli.app import run
from swarmctl.cli.verbs import ui
from swarmctl.remote.transport import HostError, Kind
from swarmctl.ui import server
from swarmctl.ui.server import Pages
from tests.timing import PATIENCE


def test_a_missing_library_is_named(
    leader_spec: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def find_spec(name: str) -> object:
        return None if name == "uvicorn" else importlib.util.find_spec(name)

    monkeypatch.setattr(extras, "find_spec", find_spec)
    assert run(["ui", str(leader_spec)]) == exit_codes.USAGE
    assert "pip install 'swarmctl[ui]'" in capsys.readouterr().err


def test_an_archive_is_not_controlled(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["ui", "--from", str(tmp_path / "a.tar.gz"), "--control"]) == exit_codes.USAGE
    assert "connects to no host" in capsys.readouterr().err
    assert run(["ui", "--from", str(tmp_path / "a.tar.gz")]) == exit_codes.ERROR
    assert "does not exist" in capsys.readouterr().err


def test_a_port_in_use_is_one_line(leader_spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = str(other.getsockname()[1])
        assert run(["ui", str(leader_spec), "--port", port]) == exit_codes.ERROR
    assert capsys.readouterr().err.startswith(f"error: --port {port}: Address already in use\n")


def test_a_request_that_fails_says_so_on_the_page(monkeypatch: pytest.MonkeyPatch) -> None:
    def lost(*_: object) -> NoReturn:
        raise HostError(Kind.LOST, "k3-pi is not connected")

    def boom(*_: object) -> NoReturn:
        raise KeyError("x")

    pages, sent = Pages(), SimpleQueue[Any]()
    monkeypatch.setattr(pages, "send", lambda *message: sent.put(message))
    ui._answer(pages, lost, boom)
    pages.requests.put(("log", ["robot:k3"]))
    trouble = {"node": "robot:k3", "lines": [], "trouble": "k3-pi is not connected"}
    assert sent.get(timeout=PATIENCE) == ("log", trouble)
    pages.requests.put(("stop", ["k3"]))
    assert sent.get(timeout=PATIENCE) == (
        "result",
        {"text": "stop: KeyError: 'x'; this is a bug in swarmctl"},
    )


def test_ctrl_c_is_the_normal_end(
    leader_spec: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    class NobodyComes(Event):
        def wait(self, timeout: float | None = None) -> bool:
            raise KeyboardInterrupt

    class Empty(Pages):
        def __init__(self, *allowed: Any) -> None:
            super().__init__(*allowed)
            self.opened = NobodyComes()

    monkeypatch.setenv("HOME", str(leader_spec.parent))
    monkeypatch.setattr(server, "Pages", Empty)
    assert run(["ui", str(leader_spec)]) == exit_codes.OK
    assert capsys.readouterr().out.startswith("http://127.0.0.1:")
