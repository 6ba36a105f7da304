"""``validate --fix`` and ``--diff`` on files: what is written, what is printed, and what stays as it is."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from tests import ROOT

FIXABLE = ROOT / "tests/rules/fixable"


@pytest.fixture
def spec(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "swarm.yaml").write_bytes((FIXABLE / "folded.yaml").read_bytes())
    return Path("swarm.yaml")


def test_fix_writes_the_file_and_says_what_it_did(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["validate", "--fix", str(spec)]) == exit_codes.OK
    assert spec.read_bytes() == (FIXABLE / "folded.fixed.yaml").read_bytes()
    output = capsys.readouterr()
    assert output.err == (
        "fixed SPEC003 swarm.yaml:4:9: rename `Laptop` to `laptop` in 4 places\n"
        "fixed REF001 swarm.yaml:12:7: write `laptop`\n"
        "fixed SPEC001 swarm.yaml:25:5: rename the key to `baud`\n"
    )
    assert output.out.startswith("swarm.yaml: swarm `lab` is valid")
    assert run(["validate", "--fix", str(spec)]) == exit_codes.OK
    assert capsys.readouterr().err == ""


def test_errors_without_fix_are_printed_and_set_the_exit_code(
    spec: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec.write_text(spec.read_text("utf-8").replace("/dev/ttyS0", "/dev/swarm/koala"), "utf-8")
    assert run(["validate", str(spec)]) == exit_codes.ERROR
    assert "7 errors (6 fixable with validate --fix) in swarm.yaml" in capsys.readouterr().err
    assert run(["validate", "--fix", str(spec)]) == exit_codes.ERROR
    output = capsys.readouterr().err
    assert output.count("fixed ") == 3
    assert output.endswith("1 error in swarm.yaml\n")
    assert "host: laptop" in spec.read_text("utf-8")


def test_diff_shows_the_change_and_writes_nothing(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = spec.read_bytes()
    assert run(["validate", "--diff", str(spec)]) == exit_codes.ERROR
    output = capsys.readouterr()
    assert output.err == ""
    assert output.out.startswith("--- swarm.yaml\n+++ swarm.yaml\n@@ -1,25 +1,24 @@\n")
    assert (
        "-    baudrate: 115200    # as the manual says\n+    baud: 115200    # as the manual says\n"
        in output.out
    )
    assert spec.read_bytes() == before
    assert run(["validate", "--fix", "--quiet", str(spec)]) == exit_codes.OK
    assert run(["validate", "--diff", str(spec)]) == exit_codes.OK
    assert capsys.readouterr().out == ""


def test_a_file_without_a_last_line_end_has_a_diff_that_patch_reads(
    spec: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec.write_text(spec.read_text("utf-8").rstrip("\n"), "utf-8")
    run(["validate", "--diff", str(spec)])
    assert capsys.readouterr().out.count("\n\\ No newline at end of file\n") == 2


def test_byte_order_mark_mode_and_link_stay(spec: Path) -> None:
    real = Path("lab.yaml")
    spec.rename(real)
    spec.symlink_to(real)
    real.write_bytes(b"\xef\xbb\xbf" + real.read_bytes().replace(b"\n", b"\r\n"))
    real.chmod(0o640)
    assert run(["validate", "--fix", str(spec)]) == exit_codes.OK
    fixed = (FIXABLE / "folded.fixed.yaml").read_bytes().replace(b"\n", b"\r\n")
    assert real.read_bytes() == b"\xef\xbb\xbf" + fixed
    assert spec.is_symlink()
    assert real.stat().st_mode & 0o777 == 0o640
    assert sorted(one.name for one in Path().iterdir()) == ["lab.yaml", "swarm.yaml"]


@pytest.mark.skipif(os.geteuid() != 0, reason="only root gives files away")
def test_the_owner_stays(spec: Path) -> None:
    os.chown(spec, 1234, 4321)
    assert run(["validate", "--fix", str(spec)]) == exit_codes.OK
    assert (spec.stat().st_uid, spec.stat().st_gid) == (1234, 4321)


def test_a_file_that_cannot_be_replaced_stays_whole(
    spec: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise OSError(28, "No space left on device")

    before = spec.read_bytes()
    monkeypatch.setattr(os, "fsync", refuse)
    assert run(["validate", "--fix", str(spec)]) == exit_codes.ERROR
    assert "cannot write swarm.yaml: No space left on device" in capsys.readouterr().err
    assert spec.read_bytes() == before
    assert [one.name for one in Path().iterdir()] == ["swarm.yaml"]


def test_a_file_that_may_not_be_written_is_left_alone(
    spec: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    before = spec.read_bytes()
    monkeypatch.setattr(os, "access", lambda _, mode: mode == os.R_OK)
    assert run(["validate", "--fix", str(spec)]) == exit_codes.ERROR
    assert "swarm.yaml was not written: it is read-only" in capsys.readouterr().err
    assert spec.read_bytes() == before


def test_several_specs_are_fixed_one_by_one(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    other = Path("other.yaml")
    other.write_bytes((FIXABLE / "many-at-once.yaml").read_bytes())
    assert run(["validate", "--unsafe-fixes", str(spec), str(other)]) == exit_codes.OK
    assert other.read_bytes() == (FIXABLE / "many-at-once.fixed.yaml").read_bytes()
    assert "fixed SPEC001 other.yaml:8:20: rename the key to `address`" in capsys.readouterr().err


def test_the_summary_counts_what_fix_then_does(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Two words are corrected; the host missing on its network stays, since its fix is a guess."""
    spec.write_bytes((FIXABLE / "many-at-once.fixed.yaml").read_bytes())
    text = spec.read_text("utf-8")
    text = text.replace("host: k3-pi, robot", "hots: k3-pi, robot").replace("mode:  leader", "mode:  leeder")
    spec.write_text(text.replace("[koala-laptop, k3-pi, epuck-pi]", "[koala-laptop, k3-pi]"), "utf-8")
    counts = []
    for arguments in (["--format", "json"], ["--unsafe-fixes", "--format", "json"]):
        run(["validate", *arguments, str(spec)])
        report = json.loads(capsys.readouterr().out)["specs"][0]
        counts.append((report["fixable"], report["more_fixable"], report["valid"]))
    assert counts == [(2, 1, False), (0, 0, True)]


def test_unsafe_fixes_are_shown_and_applied_only_when_asked_for(
    spec: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec.write_bytes((FIXABLE / "many-at-once.fixed.yaml").read_bytes())
    text = spec.read_text("utf-8").replace("[koala-laptop, k3-pi, epuck-pi]", "[koala-laptop, k3-pi]")
    spec.write_text(text, "utf-8")
    assert run(["validate", "--fix", str(spec)]) == exit_codes.ERROR
    assert "1 error (1 fixable with validate --unsafe-fixes)" in capsys.readouterr().err
    assert run(["validate", "--diff", str(spec)]) == exit_codes.OK
    assert run(["validate", "--diff", "--unsafe-fixes", str(spec)]) == exit_codes.ERROR
    assert spec.read_text("utf-8") == text
    assert run(["validate", "--unsafe-fixes", str(spec)]) == exit_codes.OK
    assert "hosts: [koala-laptop, k3-pi, epuck-pi]" in spec.read_text("utf-8")
