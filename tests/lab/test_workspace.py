"""A workspace of the operator's own: found whole or refused, and met by every host as if it were its own."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from swarmctl.lab import paths
from swarmctl.lab.errors import LabError
from swarmctl.lab.hosts import disks, nspawn
from swarmctl.lab.hosts.disks import Entry, Link
from swarmctl.lab.hosts.workspace import workspace_of
from swarmctl.lab.lab_plan import LabPlan, Workspace
from tests.lab.lab_values import plan_from
from tests.lab.tiny_labs import booted, in_a_lab, on

PLACE = "/opt/ros/noetic"


def built(folder: Path, *, sources: str = "", upon: str = "") -> Path:
    """A space as catkin leaves it."""
    folder.mkdir(parents=True)
    (folder / "setup.sh").touch()
    (folder / ".catkin").write_text(sources)
    (folder / "_setup_util.py").write_text(f"    CMAKE_PREFIX_PATH = r'{upon}'.split(';')\n")
    return folder


@pytest.mark.parametrize("given", [".", "devel"])
def test_a_devel_space_includes_its_sources(tmp_path: Path, given: str) -> None:
    sources = tmp_path / "ws/src"
    sources.mkdir(parents=True)
    space = built(tmp_path / "ws/devel", sources=str(sources))

    found = workspace_of(tmp_path / "ws" / given, PLACE)

    assert (found.space, found.place) == (str(space), PLACE)
    assert any(sources.is_relative_to(folder) for folder in found.folders)


def test_a_workspace_includes_those_it_was_built_on_without_ros(tmp_path: Path) -> None:
    base = built(tmp_path / "base/install")
    built(tmp_path / "ws/install", upon=f"{base};/opt/ros/noetic")

    assert workspace_of(tmp_path / "ws", PLACE).folders == (str(tmp_path / "ws"), str(base))


def test_an_unbuilt_workspace_is_refused_with_a_fix(tmp_path: Path) -> None:
    (tmp_path / "unbuilt/src").mkdir(parents=True)
    built(tmp_path / "with space/devel")
    for name, complaint, fix in (
        ("nowhere", "there is no workspace", "src"),
        ("unbuilt", "has no devel/setup.sh", "catkin_make"),
        ("with space", "that ROS cannot use", "move"),
    ):
        with pytest.raises(LabError, match=complaint) as caught:
            workspace_of(tmp_path / name, PLACE)
        assert fix in caught.value.help_lines[0]


def test_hosts_see_it_at_its_own_path_and_at_the_spec_path(tmp_path: Path) -> None:
    workspace = Workspace("/srv/ws/devel", PLACE, ("/srv/ws", "/srv/base"))
    plan = plan_from(tmp_path)

    argv = nspawn.nspawn_argv(plan.hosts[0], paths.lab_paths("tiny").host("alpha"), Path("/ns"), workspace)
    assert {"--bind-ro=/srv/ws", "--bind-ro=/srv/base"} <= set(argv)

    link, unit = disks.workspace_entries(workspace)
    assert link == Link("opt/ros/noetic", "/srv/ws/devel")
    assert isinstance(unit, Entry)
    assert "BindReadOnlyPaths=/srv/ws /srv/base\n" in unit.content


def test_a_path_inside_the_workspace_needs_no_link() -> None:
    workspace = Workspace("/home/robot/ws/devel", "/home/robot/ws", ("/home/robot/ws",))
    assert not [one for one in disks.workspace_entries(workspace) if isinstance(one, Link)]


def test_a_lab_remembers_its_workspace(tmp_path: Path) -> None:
    plan = replace(plan_from(tmp_path), workspace=Workspace("/srv/ws/devel", PLACE, ("/srv/ws",)))
    assert LabPlan.from_json(plan.to_json()) == plan


@in_a_lab
def test_a_workspace_in_a_home_folder_is_seen_by_hardened_units(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(paths.STATE_VARIABLE, str(tmp_path / "state"))
    home = tmp_path / "home/me/catkin_ws"
    space = built(home / "devel", sources=f"{home}/src")
    (space / "setup.sh").write_text("export FROM_WORKSPACE=yes\n")
    plan = replace(plan_from(tmp_path), workspace=workspace_of(home, PLACE))

    with booted(plan) as name:
        for host in ("alpha", "beta"):
            assert on(name, host, f". {PLACE}/setup.sh && echo $FROM_WORKSPACE") == "yes"
            assert on(name, host, f"touch {space}/mark 2>&1 || true").endswith("Read-only file system")
        hardened = "-p DynamicUser=yes -p ProtectHome=yes -p PrivateTmp=yes -p ProtectSystem=strict"
        run = f"systemd-run --quiet --wait --pipe --unit=swarm-tiny.check {hardened} ls {space}/setup.sh"
        assert on(name, "beta", run) == f"{space}/setup.sh"
