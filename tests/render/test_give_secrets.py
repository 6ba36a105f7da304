"""How a unit hands secrets to its program: values survive, and only the program's account reads them."""

from __future__ import annotations

import getpass
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests import ROOT

SCRIPT = ROOT / "templates/os/give-secrets"
PRINTED = st.text(st.characters(min_codepoint=32, exclude_categories=["Cc", "Cs", "Zl", "Zp"]), min_size=1)


def give(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(SCRIPT), "--owner", getpass.getuser(), "--source", str(folder / "kept")]
    return subprocess.run(
        [*command, "--to", str(folder / "run/given"), *words], capture_output=True, text=True, check=False
    )


@pytest.fixture
def kept(tmp_path: Path) -> Path:
    (tmp_path / "kept").mkdir()
    (tmp_path / "kept/web-token").write_text('pa$$ "w\\o`rd')
    (tmp_path / "kept/web-key").write_text("-----BEGIN\nabc\n-----END\n")
    return tmp_path


def test_files_and_variables_are_given_to_the_account_alone(kept: Path) -> None:
    done = give(kept, "--variable", "TOKEN=web-token", "--file", "key.pem=web-key")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    given = kept / "run/given"
    assert (given / "key.pem").read_text() == "-----BEGIN\nabc\n-----END\n"
    assert {one.name: one.stat().st_mode & 0o777 for one in given.iterdir()} == {
        "key.pem": 0o400, ".environment": 0o400
    }  # fmt: skip
    assert given.stat().st_mode & 0o777 == 0o711


def test_what_was_given_before_is_gone(kept: Path) -> None:
    give(kept, "--file", "old.pem=web-key")
    give(kept, "--file", "key.pem=web-key")
    assert not (kept / "run/given/old.pem").exists()


def test_a_missing_secret_is_named_and_no_other_is_shown(kept: Path) -> None:
    done = give(kept, "--variable", "TOKEN=web-token", "--variable", "OTHER=gone")
    assert done.returncode == 1
    assert "this host has no secret gone" in done.stderr
    assert "pa$$" not in done.stderr


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(value=PRINTED)
def test_any_value_of_a_variable_survives(kept: Path, value: str) -> None:
    """systemd reads the file as a shell does (systemd.exec(5), EnvironmentFile=)."""
    (kept / "kept/web-token").write_text(value)
    assert give(kept, "--variable", "TOKEN=web-token").returncode == 0
    show = f'. {kept}/run/given/.environment; printf %s "$TOKEN"'
    assert subprocess.run(["bash", "-c", show], capture_output=True, check=True).stdout.decode() == value
