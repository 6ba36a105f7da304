"""``swarmctl migrate`` as people type it, with made-up versions of the format."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from swarmctl.migration import versions
from swarmctl.spec import load
from tests.migration.made_up import FORMATS

OLD = "version: 1   # ours\nhosts:\n  pi: {address: robot@10.0.0.1}\n"
NEW = "version: 2   # ours\nhosts:\n  pi: {address: 10.0.0.1, user: robot}\n"


@pytest.fixture
def spec(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("swarm.yaml").write_text(OLD, "utf-8")
    return Path("swarm.yaml")


@pytest.fixture
def _made_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(versions, "SPEC_VERSIONS", FORMATS)
    monkeypatch.setattr(load, "SPEC_VERSIONS", FORMATS)


@pytest.mark.usefixtures("_made_up")
def test_the_edit_is_shown_and_then_written(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["migrate", "swarm.yaml"]) == exit_codes.OK
    shown = capsys.readouterr()
    assert "-  pi: {address: robot@10.0.0.1}\n+  pi: {address: 10.0.0.1, user: robot}\n" in shown.out
    assert shown.err.endswith("swarm.yaml: would be of version 2\n")
    assert spec.read_text("utf-8") == OLD
    assert run(["migrate", "swarm.yaml", "--write"]) == exit_codes.OK
    assert capsys.readouterr().err.endswith("swarm.yaml: is now of version 2\n")
    assert spec.read_text("utf-8") == NEW
    assert run(["migrate", "swarm.yaml", "--write"]) == exit_codes.OK
    assert capsys.readouterr().err == "swarm.yaml: is already of version 2\n"
    assert spec.read_text("utf-8") == NEW


@pytest.mark.usefixtures("_made_up")
def test_what_cannot_be_migrated_is_an_error(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    spec.write_text(OLD.replace("robot@", ""), "utf-8")
    assert run(["migrate", "swarm.yaml", "--write"]) == exit_codes.ERROR
    err = capsys.readouterr().err
    assert "swarm.yaml:3:8: `hosts.pi.address` cannot be rewritten: `10.0.0.1` has no account" in err
    assert spec.read_text("utf-8") == OLD.replace("robot@", "")


@pytest.mark.usefixtures("_made_up")
def test_validate_shows_the_way_and_nothing_else(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["validate", "swarm.yaml", "--format", "concise"]) == exit_codes.ERROR
    out = capsys.readouterr().out.splitlines()
    assert out[0] == (
        "swarm.yaml:1:10: error[SPEC006] this spec has version 1 of the format; the current one is 2"
    )
    assert len([line for line in out if "error[" in line]) == 1
    assert run(["validate", "swarm.yaml"]) == exit_codes.ERROR
    assert "`swarmctl migrate swarm.yaml` shows the new text" in capsys.readouterr().err


@pytest.mark.parametrize("version", ["2", "3", "-1"])
def test_an_unknown_version_is_a_usage_error(
    spec: Path, version: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["migrate", str(spec), "--to", version]) == exit_codes.USAGE
    assert f"--to {version}: this swarmctl knows version 1" in capsys.readouterr().err


def test_a_newer_spec_is_not_touched(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    spec.write_text(NEW, "utf-8")
    assert run(["migrate", str(spec), "--write"]) == exit_codes.ERROR
    assert "version 2 of the spec format is newer than this swarmctl" in capsys.readouterr().err
    assert spec.read_text("utf-8") == NEW


@pytest.mark.parametrize("version", ["", "version: -3\n", "version: 0\n", "version: 2.5\n", "version: v1\n"])
def test_a_spec_without_a_known_version_is_an_error(
    spec: Path, version: str, capsys: pytest.CaptureFixture[str]
) -> None:
    spec.write_text(f"{version}hosts: {{}}\n", "utf-8")
    assert run(["migrate", str(spec)]) == exit_codes.ERROR
    assert "swarm.yaml declares no version of the format that this swarmctl knows" in capsys.readouterr().err
