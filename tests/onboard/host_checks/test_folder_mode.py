from __future__ import annotations

from pathlib import Path

import pytest
from swarm_onboard.agent.release_store import Home
from swarm_onboard.host_checks.folder_mode import judge, observe

DIGEST = "0123456789abcdef"


def host(folder: Path) -> Home:
    """A host with a release, as a deploy leaves its folders."""
    home = Home("new", str(folder))
    home.prepare()
    Path(home.release(DIGEST)).mkdir()
    Path(home.current_link).symlink_to(f"releases/{DIGEST}")
    return home


@pytest.mark.parametrize("name", ["", "new", "new/releases", f"new/releases/{DIGEST}"])
def test_a_folder_that_units_cannot_enter_is_bad(tmp_path: Path, name: str) -> None:
    home = host(tmp_path)
    closed = tmp_path / "opt/swarm" / name
    closed.chmod(0o700)
    (seen,) = observe(home)
    found = judge(seen, "pi")
    assert (found.state, found.hint) == ("bad", f"on pi: sudo chmod go+rx {closed}")


@pytest.mark.parametrize("mode", [0o755, 0o711])
def test_a_folder_that_units_can_enter_is_right(tmp_path: Path, mode: int) -> None:
    home = host(tmp_path)
    Path(home.path).chmod(mode)
    (seen,) = observe(home)
    assert judge(seen, "pi").state == "ok"


def test_a_host_without_a_release_has_nothing_to_check(tmp_path: Path) -> None:
    assert observe(Home("new", str(tmp_path))) == []
