"""What the agent finds out about the image of a container, from the engine's answer."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from swarm_onboard.agent import images

NAME = "localhost/see@sha256:" + "1" * 64
MACHINE = os.uname().machine


def answer(folder: Path, monkeypatch: pytest.MonkeyPatch, script: str) -> images.Image:
    engine = folder / "podman"
    engine.write_text(f"#!/bin/sh\n{script}\n", "utf-8")
    engine.chmod(0o755)
    monkeypatch.setenv("PATH", str(folder), prepend=os.pathsep)
    return images.look("podman", NAME)


def test_an_image_is_there_with_its_architecture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = answer(tmp_path, monkeypatch, f'[ "$5" = {NAME} ] && [ "$1 $2" = "image inspect" ] && echo arm64')
    assert found == (True, "arm64", MACHINE, "")


@pytest.mark.parametrize(
    "complaint", ["Error: inspecting object: x: image not known", "Error: No such image: x"]
)
def test_an_unknown_image_is_not_there(
    complaint: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = answer(tmp_path, monkeypatch, f"echo '{complaint}' >&2; exit 125")
    assert found == (False, "", MACHINE, "")


def test_an_engine_that_fails_is_an_error_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert answer(tmp_path, monkeypatch, "echo no space >&2; exit 1").error == "no space"
    monkeypatch.setenv("PATH", "/nowhere")
    missing = images.look("podman", NAME)
    assert missing.error.startswith("podman cannot be run: No such file")
