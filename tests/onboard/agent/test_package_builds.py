"""Builds on a host: sources that keep their times, the first error of a log, and what is packed."""

from __future__ import annotations

import io
import os
import pwd
import stat
import subprocess
import tarfile
from pathlib import Path

import pytest
from swarm_onboard.agent import catkin, disk, platforms, rosdep, workspaces
from swarm_onboard.agent.errors import FailedError, RefusedError
from swarm_onboard.agent.package_builds import Workspace
from swarm_onboard.agent.release_store import Home

OWNER = pwd.getpwuid(os.getuid())
TOOL = """#!/bin/sh
echo "==> Processing catkin package: 'nav'"
echo "$SETUPS" > "$2/setups"
echo "$* ROS_VERSION=$ROS_VERSION" > "$2/called"
D="$2/devel_isolated/nav/lib"; mkdir -p "$D/nav" "$D/pkgconfig" "$D/python3"
printf '\\177ELF %s/src/nav' "$2" > "$D/nav/node"; chmod 755 "$D/nav/node"
echo "# $2/src/nav/scripts/go.py" > "$D/python3/go.py"
touch "$D/libnav.a" "$D/pkgconfig/nav.pc"; ln -sf nav/node "$D/libnav.so"; ln -sf /etc/passwd "$D/x"
B="$2/build_isolated/nav"; mkdir -p "$B"; echo early > "$B/libearly.so"
touch "$B/Makefile"; ln -sf /etc/passwd "$B/libx.so"
grep -q broken "$2/src/nav/a.cpp" || exit 0
echo "$2/src/nav/a.cpp:1:1: error: 'broken' does not name a type"; exit 1
"""


def sources(**files: str) -> bytes:
    stream = io.BytesIO()
    with tarfile.open(fileobj=stream, mode="w:gz") as archive:
        for name, text in files.items():
            member = tarfile.TarInfo(name)
            member.size = len(text)
            archive.addfile(member, io.BytesIO(text.encode()))
    return stream.getvalue()


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Workspace:
    tool = tmp_path / "bin/catkin_make_isolated"
    tool.parent.mkdir()
    tool.write_text(TOOL)
    tool.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tool.parent}:{os.environ['PATH']}")
    return Workspace(Home("new", str(tmp_path)))


def built(workspace: Workspace, *setups: str, **files: str) -> list[str]:
    notes: list[str] = []
    with workspace.held(OWNER):
        workspace.write_sources(sources(**files))
        workspace.build(OWNER, setups, {"nav": "src/nav"}, notes.append)
    return notes


def test_unchanged_sources_keep_their_times(workspace: Workspace) -> None:
    first = {"nav/a.cpp": "1", "nav/b.cpp": "1", "old/c.cpp": "1"}
    with workspace.held(OWNER):
        assert workspace.write_sources(sources(**first)) == ["nav", "old"]
    for name in ("a", "b"):
        os.utime(f"{workspace.path}/src/nav/{name}.cpp", (1, 1))
    with workspace.held(OWNER):
        assert workspace.write_sources(sources(**{"nav/a.cpp": "1", "nav/b.cpp": "2"})) == ["nav"]
    assert Path(f"{workspace.path}/src/nav/a.cpp").stat().st_mtime == 1
    assert Path(f"{workspace.path}/src/nav/b.cpp").stat().st_mtime > 1
    assert [one.name for one in Path(f"{workspace.path}/src").iterdir()] == ["nav"]


@pytest.mark.parametrize("name", ["a", "../x/a", "nav/../../a", "/etc/a", "nav//a"])
def test_sources_stay_in_their_folder(workspace: Workspace, name: str) -> None:
    with workspace.held(OWNER), pytest.raises(RefusedError):
        workspace.write_sources(sources(**{name: "1"}))


def test_only_what_runs_is_packed(workspace: Workspace) -> None:
    assert built(workspace, **{"nav/a.cpp": "ok"}) == ["nav"]
    size = workspace.pack("nav")
    archive = workspace.piece("nav", 0)
    assert (len(archive), workspace.piece("nav", size)) == (size, b"")
    with tarfile.open(fileobj=io.BytesIO(archive)) as packed:
        found = {one.name: (packed.extractfile(one).read(), one.mode) for one in packed}  # type: ignore[union-attr]
    assert set(found) == {"lib/nav/node", "lib/python3/go.py", "lib/libearly.so", "lib/libnav.so"}
    assert found["lib/python3/go.py"] == (b"# /opt/swarm/new/current/packages/nav/scripts/go.py\n", 0o644)
    assert found["lib/nav/node"][1] == 0o755
    assert workspace.path.encode() in found["lib/nav/node"][0]  # a text in a compiled file keeps its length
    with pytest.raises(RefusedError):
        workspace.piece("../nav", 0)


def test_a_failed_build_names_the_operators_file(workspace: Workspace) -> None:
    with pytest.raises(FailedError) as error:
        built(workspace, **{"nav/a.cpp": "broken"})
    assert error.value.message == "the build failed: src/nav/a.cpp:1:1: 'broken' does not name a type"
    assert f"{workspace.path}/log" in error.value.hint
    assert "error: 'broken'" in Path(f"{workspace.path}/log").read_text()


def test_another_basis_begins_anew(workspace: Workspace, tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / f"{name}.sh").write_text("")
    kept = Path(f"{workspace.path}/devel_isolated/nav/kept")
    built(workspace, f"{tmp_path}/a.sh", **{"nav/a.cpp": "1"})
    kept.write_text("")
    built(workspace, f"{tmp_path}/a.sh", **{"nav/a.cpp": "2"})
    assert kept.exists()
    built(workspace, f"{tmp_path}/b.sh", **{"nav/a.cpp": "2"})
    assert not kept.exists()
    assert Path(f"{workspace.path}/setups").read_text() == f"{tmp_path}/b.sh\n"


def test_a_build_is_for_ros_1_without_tests(workspace: Workspace, monkeypatch: pytest.MonkeyPatch) -> None:
    """Debian's ROS has no setup file that sets ROS_VERSION, and `test_depend` is not installed."""
    monkeypatch.delenv("ROS_VERSION", raising=False)
    built(workspace, **{"nav/a.cpp": "1"})
    called = Path(f"{workspace.path}/called").read_text().split()
    assert {"-DCATKIN_ENABLE_TESTING=OFF", "ROS_VERSION=1"} <= set(called)


def test_two_builds_do_not_meet(workspace: Workspace) -> None:
    with workspace.held(OWNER), pytest.raises(RefusedError), workspace.held(OWNER):
        pass
    assert stat.S_IMODE(Path(workspace.path).stat().st_mode) == 0o755
    assert stat.S_IMODE(Path(workspace.path, ".lock").stat().st_mode) == 0o600, "others could hold it"


@pytest.mark.parametrize(
    ("log", "error"),
    [
        (["[ 50%] Building", "/w/src/a.cpp:3:5: error: 'x' was not declared", "/w/b.cpp:1:1: error: y"],
         "/w/src/a.cpp:3:5: 'x' was not declared"),
        (["/w/a.cpp:1:10: fatal error: nav/Goal.h: No such file or directory"],
         "/w/a.cpp:1:10: nav/Goal.h: No such file or directory"),
        (["CMake Error at /w/src/nav/CMakeLists.txt:3 (find_package):", "  By not providing", "  x.cmake",
          "", "Call Stack"],
         "/w/src/nav/CMakeLists.txt:3: By not providing x.cmake"),
        (["/usr/bin/ld: nav_node.cpp:(.text+0x1): undefined reference to `planned()'"],
         "nav_node.cpp: undefined reference to `planned()'"),
        (["Error(s) in package '/w/src/nav/package.xml':", "The manifest must have a version"],
         "Error(s) in package '/w/src/nav/package.xml': The manifest must have a version"),
        (["/w/a.cpp:3:5: warning: unused", "make: *** [all] Error 2"], ""),
    ],
)  # fmt: skip
def test_the_first_error_of_a_log_is_found(log: list[str], error: str) -> None:
    assert catkin.first_error(log) == error


def test_the_first_workspace_is_sourced_last(tmp_path: Path) -> None:
    for place in ("front/devel", "behind/install", "opt/ros/noetic"):
        (tmp_path / place).mkdir(parents=True)
        (tmp_path / place / "setup.sh").write_text("")
    found = catkin.setup_files(["/front", "/absent", "/behind"], lambda path: f"{tmp_path}{path}")
    expected = ["opt/ros/noetic", "behind/install", "front/devel"]
    assert found == [f"{tmp_path}/{place}/setup.sh" for place in expected]


def test_a_full_disk_is_named(workspace: Workspace) -> None:
    tool = Path(os.environ["PATH"].partition(":")[0]) / "catkin_make_isolated"
    tool.write_text("#!/bin/sh\necho 'a.cpp:1:1: fatal error: x.s: No space left on device'; exit 1\n")
    with pytest.raises(FailedError, match="the build failed: the disk is full") as raised:
        built(workspace, **{"nav/a.cpp": "1"})
    assert raised.value.hint.startswith(f"free space in {disk.file_system(workspace.path)}, then")


@pytest.mark.skipif(os.geteuid() != 0, reason="mounting needs root")
def test_sources_that_do_not_fit_are_an_error_with_the_file_system(workspace: Workspace) -> None:
    Path(workspace.path).mkdir(parents=True)
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=16k", "tmpfs", workspace.path], check=True)
    try:
        with (
            pytest.raises(FailedError, match=f"the build failed: .* KiB free in {workspace.path}$"),
            disk.named_if_full(workspace.path, "the build"),
            workspace.held(OWNER),
        ):
            workspace.write_sources(sources(**{"nav/a.cpp": "1" * 50_000}))
    finally:
        subprocess.run(["umount", workspace.path], check=True)


def test_a_platform_is_a_system_a_machine_and_a_ros(tmp_path: Path) -> None:
    def seen() -> str:
        return platforms.platform(lambda path: f"{tmp_path}{path}")

    def install(place: str, version: str) -> None:
        package = tmp_path / place / "share/rosgraph/package.xml"
        package.parent.mkdir(parents=True)
        package.write_text(f'<package>\n  <version compatibility="1.0.0">{version}</version>\n</package>')

    (tmp_path / "etc").mkdir()
    (tmp_path / "etc/os-release").write_text('NAME="Ubuntu"\nID=ubuntu\nVERSION_ID="20.04"\n')
    bare = f"ubuntu-20.04-{os.uname().machine}"
    assert seen() == bare
    install("usr", "1.15.15")
    assert seen() == f"{bare}-ros-1.15.15"
    install("opt/ros/noetic", "1.16.0")
    assert seen() == f"{bare}-noetic-1.16.0"


def test_rosdep_is_read_by_key() -> None:
    output = "#ROSDEP[eigen]\n#apt\nlibeigen3-dev\n#ROSDEP[nothing]\n#apt\n\n#ROSDEP[pip-one]\n#pip\nx\n"
    assert rosdep.parsed(output) == {"eigen": ["libeigen3-dev"], "nothing": []}


def test_workspaces_are_built_from_the_last_one_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tool = tmp_path / "bin/catkin_make"
    tool.parent.mkdir()
    tool.write_text(
        '#!/bin/sh\n[ -z "$SETUPS" ] || echo "$SETUPS" > $2/upon; mkdir $2/devel; touch $2/devel/setup.sh\n'
    )
    tool.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tool.parent}:{os.environ['PATH']}")
    for place in ("front", "behind"):
        (tmp_path / place / "src").mkdir(parents=True)
    known = ["/front", "/behind"]
    workspaces.build_in_order(known, known, lambda path: f"{tmp_path}{path}", lambda _: None)
    assert (tmp_path / "front/upon").read_text() == f"{tmp_path}/behind/devel/setup.sh\n"
    assert not (tmp_path / "behind/upon").exists()
