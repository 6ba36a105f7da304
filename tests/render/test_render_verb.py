"""``swarmctl render``: files in a folder, from anywhere, over nothing that is not its own."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from swarmctl.cli.app import run


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, leader_spec: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copy(leader_spec, tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("FORCE_COLOR", raising=False)


def digests(out: str) -> dict[str, str]:
    return {line.split()[0]: line.split()[1] for line in out.splitlines()}


def test_a_folder_a_host_and_a_line_a_host(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["render", "swarm.yaml", "--out", "made/here"]) == exit_codes.OK
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == ["koala-laptop", "k3-pi", "epuck-pi"]
    manifest = json.loads(Path("made/here/k3-pi/manifest.json").read_text())
    found = {
        str(path.relative_to("made/here/k3-pi"))
        for path in Path("made/here/k3-pi").rglob("*")
        if path.is_file()
    }
    assert found == {*manifest["files"], "manifest.json"}
    for path, one in manifest["files"].items():
        assert Path("made/here/k3-pi", path).stat().st_mode & 0o777 == one["mode"]
    assert sorted(path.name for path in Path("made/here").iterdir()) == ["epuck-pi", "k3-pi", "koala-laptop"]


def test_json_is_the_only_thing_on_stdout(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["render", "swarm.yaml", "--out", "made", "--json"]) == exit_codes.OK
    answer = json.loads(capsys.readouterr().out)
    assert answer["hosts"]["k3-pi"]["path"] == "made/k3-pi"
    assert len(answer["hosts"]["k3-pi"]["digest"]) == 16


def test_again_over_an_earlier_render_takes_away_what_is_gone(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["render", "swarm.yaml", "--out", "made"]) == exit_codes.OK
    for host in ("k3-pi", "gone"):
        Path("made", host, "bin").mkdir(parents=True, exist_ok=True)
        Path("made", host, "bin/old-file").touch()
        manifest = json.loads(Path("made/k3-pi/manifest.json").read_text())
        listed = {**manifest, "host": host, "files": {**manifest["files"], "bin/old-file": {}}}
        Path("made", host, "manifest.json").write_text(json.dumps(listed))
    Path("made/.unfinished-1").mkdir()
    before = digests(capsys.readouterr().out)
    assert run(["render", "swarm.yaml", "--out", "made"]) == exit_codes.OK
    assert digests(capsys.readouterr().out) == before
    assert not Path("made/k3-pi/bin/old-file").exists()
    assert sorted(path.name for path in Path("made").iterdir()) == ["epuck-pi", "k3-pi", "koala-laptop"]


def test_one_host_leaves_the_others_alone(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["render", "swarm.yaml", "--out", "made"]) == exit_codes.OK
    other = Path("made/epuck-pi").stat().st_ino
    capsys.readouterr()
    assert run(["render", "swarm.yaml", "--out", "made", "--host", "k3-pi"]) == exit_codes.OK
    assert list(digests(capsys.readouterr().out)) == ["k3-pi"]
    assert Path("made/epuck-pi").stat().st_ino == other


@pytest.mark.parametrize("stranger", ["file.txt", "k3-pi/notes.txt"])
def test_what_is_not_a_render_is_not_touched(stranger: str, capsys: pytest.CaptureFixture[str]) -> None:
    path = Path("made") / stranger
    path.parent.mkdir(parents=True)
    path.write_text("mine")
    assert run(["render", "swarm.yaml", "--out", "made"]) == exit_codes.ERROR
    printed = capsys.readouterr()
    assert "was not written by swarmctl render" in printed.err
    assert "--force" in printed.err
    assert path.read_text() == "mine"
    assert [one for one in Path("made").rglob("*") if one.is_file()] == [path]


@pytest.mark.parametrize("mine", ["file.txt", "k3-pi/notes.txt", "k3-pi/bin/notes/1.txt", "gone/notes.txt"])
@pytest.mark.parametrize("before", ["nothing", "a render"])
def test_force_keeps_files_of_the_user(mine: str, before: str) -> None:
    if before == "a render":
        assert run(["render", "swarm.yaml", "--out", "made"]) == exit_codes.OK
        shutil.copytree("made/k3-pi", "made/gone")
        manifest = Path("made/gone/manifest.json")
        manifest.write_text(manifest.read_text().replace("k3-pi", "gone"))
    path = Path("made") / mine
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("mine")
    assert run(["render", "swarm.yaml", "--out", "made"]) == exit_codes.ERROR
    assert run(["render", "swarm.yaml", "--out", "made", "--force"]) == exit_codes.OK
    assert path.read_text() == "mine"
    assert Path("made/k3-pi/manifest.json").is_file()
    assert mine.startswith("gone/") or not Path("made/gone").exists()
    assert [one.name for one in Path("made").rglob("gone/*")] in ([], ["notes.txt"])


def test_a_file_of_the_user_in_the_way_is_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    path = Path("made/k3-pi/setup.bash")
    path.parent.mkdir(parents=True)
    path.write_text("mine")
    assert run(["render", "swarm.yaml", "--out", "made", "--force"]) == exit_codes.ERROR
    assert "made/k3-pi/setup.bash was not written by swarmctl render" in capsys.readouterr().err
    assert [one for one in Path("made").rglob("*") if not one.is_dir()] == [path]
    assert path.read_text() == "mine"


def test_two_renders_write_one_after_the_other() -> None:
    arguments = [sys.executable, "-m", "swarmctl", "render", "swarm.yaml", "--out", "made"]
    all_of_them = [
        subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE) for _ in range(3)
    ]
    assert [one.communicate()[0] and one.returncode for one in all_of_them] == [0, 0, 0]


def test_out_is_a_file(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["render", "swarm.yaml", "--out", "swarm.yaml"]) == exit_codes.ERROR
    assert "swarm.yaml was not written by swarmctl render" in capsys.readouterr().err


def test_an_unknown_host(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["render", "swarm.yaml", "--out", "made", "--host", "k3-p"]) == exit_codes.ERROR
    assert "did you mean `k3-pi`" in capsys.readouterr().err
    assert not Path("made").exists()


def test_a_wrong_spec_writes_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    Path("swarm.yaml").write_text("version: 1\n")
    assert run(["render", "swarm.yaml", "--out", "made"]) == exit_codes.ERROR
    assert "error[SPEC002]" in capsys.readouterr().err
    assert not Path("made").exists()


def test_the_folder_of_a_host_without_ros_states_that(capsys: pytest.CaptureFixture[str]) -> None:
    spec = Path("swarm.yaml")
    gate = "hosts:\n  gate: {address: gate.uni.example, user: jdoe}\n"
    spec.write_text(
        spec.read_text().replace("hosts:\n", gate, 1).replace("k3-pi: {", "k3-pi: {via: gate, ", 1)
    )
    assert run(["render", "swarm.yaml", "--out", "made"]) == exit_codes.OK
    assert json.loads(Path("made/gate/manifest.json").read_text())["files"] == {}
