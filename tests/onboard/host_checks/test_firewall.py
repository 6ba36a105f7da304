from __future__ import annotations

from pathlib import Path

import pytest
from swarm_onboard.agent.release_store import Home
from swarm_onboard.host_checks.firewall import judge, observe

from tests.onboard.host_checks.hosts import program

LOADED = "table inet swarm-new {\n\tchain input {\n\t}\n}\n"


def host(folder: Path, monkeypatch: pytest.MonkeyPatch, *, lists: str) -> Home:
    """A host with a firewall in its release, that loaded one table; its nft prints ``lists``."""
    script = f"[ \"$*\" = '-s list table inet swarm-new' ] && printf %s '{lists}'"
    program(folder, monkeypatch, "nft", script)
    kept = folder / "run/swarm-new.firewall/table"
    kept.parent.mkdir(parents=True)
    kept.write_text(LOADED)
    home = Home("new", str(folder))
    release = Path(home.path) / "releases/0123456789abcdef"
    release.mkdir(parents=True)
    (release / "firewall.nft").touch()
    Path(home.current_link).symlink_to(release)
    return home


@pytest.mark.parametrize(
    ("lists", "state", "message"),
    [
        (LOADED, "ok", "is loaded"),
        ("", "bad", "is not loaded: its ROS is open to all"),
        (LOADED.replace("input", "output"), "bad", "was changed since it was loaded"),
    ],
)
def test_the_kernel_has_the_table_that_was_loaded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lists: str, state: str, message: str
) -> None:
    (seen,) = observe(host(tmp_path, monkeypatch, lists=lists))
    found = judge(seen, "pi")
    assert (found.state, message in found.message) == (state, True)
    assert found.state == "ok" or "sudo systemctl restart swarm-new.firewall" in found.hint


def test_a_release_without_a_firewall_has_nothing_to_check(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    home = host(tmp_path, monkeypatch, lists="")
    (Path(home.current_link) / "firewall.nft").unlink()
    assert observe(home) == []
