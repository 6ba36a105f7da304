"""Images are pulled by their digests, where there is space, and a failure says what to do."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from swarm_onboard.agent import images
from swarm_onboard.agent.errors import RefusedError

DIGEST = "sha256:" + "1" * 64
IMAGE = f"registry.lab.example/see@{DIGEST}"
Engine = Callable[..., Path]


@pytest.fixture
def engine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Engine:
    """A stand-in for podman: its storage, the manifest that it knows, and how its pull ends."""

    def made(manifest: object = None, error: str = "") -> Path:
        script, calls = tmp_path / "bin/podman", tmp_path / "calls"
        script.parent.mkdir(exist_ok=True)
        (tmp_path / "manifest").write_text(json.dumps(manifest))
        script.write_text(
            f'#!/bin/sh\necho "$@" >> {calls}\ncase $1 in\ninfo) echo {tmp_path}/storage ;;\n'
            f"manifest) cat {tmp_path}/manifest ;;\n"
            f"pull) echo Copying blob one; [ -z '{error}' ] || {{ echo '{error}'; exit 125; }} ;;\nesac\n"
        )
        script.chmod(0o755)
        monkeypatch.setenv("PATH", f"{script.parent}:/usr/bin:/bin")
        return calls

    return made


def pulled(*targets: str) -> list[str]:
    """The notes of a pull."""
    notes: list[str] = []
    images.pull_all(targets, notes.append)
    return notes


def test_a_pull_reports_its_progress(engine: Engine) -> None:
    calls = engine({"layers": [{"size": 1000}]})
    assert pulled(f"podman {IMAGE}")[-1] == "registry.lab.example/see: Copying blob one"
    assert f"pull {IMAGE}" in calls.read_text().splitlines()


def test_an_image_that_does_not_fit_is_not_pulled(engine: Engine) -> None:
    calls = engine({"layers": [{"size": 1 << 50}, {"size": 1}]})
    with pytest.raises(RefusedError, match=r"needs about 4294967296 MiB in /.*, and \d+ MiB are free"):
        pulled(f"podman {IMAGE}")
    assert "pull" not in calls.read_text()


def test_the_size_is_that_of_the_image_for_this_machine() -> None:
    listed = {
        "manifests": [
            {"digest": "sha256:a", "platform": {"architecture": "amd64", "os": "linux"}},
            {"digest": "sha256:b", "platform": {"architecture": "arm64", "os": "linux"}},
        ]
    }
    assert images.digest_for(listed, "aarch64") == "sha256:b"
    assert images.size_of({"layers": [{"size": 3}, {"size": 4}, {"size": "x"}, 1]}) == 7
    for odd in (None, [], {"manifests": 1, "layers": {}}, {"manifests": [None, {"platform": 2}]}):
        assert (images.digest_for(odd, "x86_64"), images.size_of(odd)) == ("", 0)


@pytest.mark.parametrize(
    ("error", "advice"),
    [
        ("Error: unauthorized: access to the requested resource", "sudo podman login registry.lab.example"),
        ("Error: reading manifest: manifest unknown", "is the digest that of the registry"),
        ("write /var/lib/x: no space left on device", "podman image prune --all"),
        ("dial tcp: lookup registry.lab.example: no such host", "does the host reach the registry"),
    ],
)
def test_a_failed_pull_says_what_to_do(engine: Engine, error: str, advice: str) -> None:
    engine(error=error)
    with pytest.raises(RefusedError, match=error[-20:]) as raised:
        pulled(f"podman {IMAGE}")
    assert advice in raised.value.hint


@pytest.mark.parametrize("target", [f"rm {IMAGE}", "podman see:latest", f"podman --x@{DIGEST}", "podman"])
def test_nothing_but_a_pinned_image_is_pulled(engine: Engine, target: str) -> None:
    calls = engine()
    with pytest.raises(RefusedError):
        pulled(target)
    assert not calls.exists()
