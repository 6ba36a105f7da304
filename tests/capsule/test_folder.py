"""What is written is read again, and whatever differs from the index is found; nothing leaves the folder."""

from __future__ import annotations

import hashlib
import os
import stat
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from swarmctl.capsule.capsule_index import INDEX, SIGNATURE, CapsuleError
from swarmctl.capsule.folder import below, problems, read, write
from tests.capsule.trial_folder import ABOUT, FILES, edit, filled


@pytest.fixture
def capsule(tmp_path: Path) -> Path:
    folder = filled(tmp_path / "circle-3")
    write(folder, ABOUT)
    return folder


def test_what_is_written_is_read(tmp_path: Path) -> None:
    folder = filled(tmp_path)
    written = write(folder, ABOUT)
    assert read(folder) == written
    assert problems(folder) == ()
    assert {name: (one.sha256, one.bytes) for name, one in written.files.items()} == {
        name: (hashlib.sha256(content).hexdigest(), len(content)) for name, content in FILES.items()
    }
    assert (written.spec, written.robots["k3"].proof) == (["spec/swarm.yaml", "spec/night.yaml"], "wheels")
    assert sorted(one.name for one in folder.iterdir()) == ["bags", INDEX, "spec", "status-before.json"]


def test_an_interrupted_trial_without_git_has_an_index(tmp_path: Path) -> None:
    hosts = {"k3-pi": {"release": "", "began": None}}
    about = ABOUT | {"outcome": "interrupted", "cause": "Ctrl-C", "git": None, "skew": None, "hosts": hosts}
    write(filled(tmp_path), about)
    assert read(tmp_path).cause == "Ctrl-C"
    assert read(tmp_path).hosts["k3-pi"].address == ""


def test_an_index_of_before_hardware_was_in_it_is_read(capsule: Path) -> None:
    def without(index: dict[str, Any]) -> None:
        for field in ("kernel", "model", "devices", "packages"):
            del index["hosts"]["k3-pi"][field]
        for field in ("port", "firmware"):
            del index["robots"]["k3"][field]

    edit(capsule, without)
    index = read(capsule)
    assert (index.hosts["k3-pi"].devices, index.robots["k3"].firmware) == ([], "")


def test_texts_of_hosts_are_escaped(tmp_path: Path) -> None:
    write(filled(tmp_path), ABOUT | {"outcome": "failed", "cause": "\x1b[2Jgone\n\udc80" + "x" * 9999})
    assert read(tmp_path).cause.startswith(r"\x1b[2Jgone\n\udc80xxx")


def changed(folder: Path) -> None:
    with (folder / "bags/k3-pi_0.bag").open("r+b") as file:
        file.seek(2_000_000)
        file.write(b"!!")


def longer(folder: Path) -> None:
    with (folder / "status-before.json").open("ab") as file:
        file.write(b"\n")


def link(folder: Path) -> None:
    file = folder / "status-before.json"
    same = folder.parent / "same.json"
    file.rename(same)
    file.symlink_to(same)


def linked_folder(folder: Path) -> None:
    (folder / "bags").rename(folder.parent / "bags")
    (folder / "bags").symlink_to(folder.parent / "bags")


DAMAGES: dict[Callable[[Path], object], tuple[str, ...]] = {
    changed: ("bags/k3-pi_0.bag has changed",),
    longer: ("status-before.json has changed",),
    link: ("status-before.json is a link",),
    linked_folder: ("bags is a link", "bags/k3-pi_0.bag is missing"),
    lambda folder: (folder / "spec/night.yaml").unlink(): ("spec/night.yaml is missing",),
    lambda folder: (folder / "bags/no\x1b.bag").touch(): (r"bags/no\x1b.bag was added",),
    lambda folder: (folder / "spec" / INDEX).touch(): (f"spec/{INDEX} was added",),
    lambda folder: os.mkfifo(folder / "pipe"): ("pipe is not a file",),
    lambda folder: (folder / SIGNATURE).symlink_to("/dev/zero"): (f"{SIGNATURE} is a link",),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_every_difference_is_found(capsule: Path, damage: Callable[[Path], object]) -> None:
    damage(capsule)
    assert problems(capsule) == DAMAGES[damage]


@pytest.mark.parametrize(
    "path", ["../out", "/etc/passwd", "bags/../../out", "./a", "a//b", "", "a/", "a\nb", INDEX, SIGNATURE]
)
def test_a_path_outside_is_refused(capsule: Path, path: str) -> None:
    edit(capsule, lambda index: index["files"].update({path: {"sha256": "0" * 64, "bytes": 0}}))
    with pytest.raises(CapsuleError, match="is not an index: files"):
        problems(capsule)


def test_the_spec_is_one_of_the_files(capsule: Path) -> None:
    edit(capsule, lambda index: index["spec"].append("spec/other.yaml"))
    with pytest.raises(CapsuleError, match=r"spec/other\.yaml of `spec` is not one of `files`"):
        read(capsule)


def test_links_are_neither_followed_nor_hashed(tmp_path: Path) -> None:
    (tmp_path / "secret").write_text("secret")
    folder = filled(tmp_path / "trial")
    (folder / "bags/secret").symlink_to(tmp_path / "secret")
    (folder / INDEX).symlink_to(tmp_path / "secret")
    assert set(write(folder, ABOUT).files) == set(FILES)
    assert (tmp_path / "secret").read_text() == "secret"
    assert problems(folder) == ("bags/secret is a link",)


def test_a_linked_index_is_refused(capsule: Path) -> None:
    (capsule / INDEX).rename(capsule.parent / INDEX)
    (capsule / INDEX).symlink_to(capsule.parent / INDEX)
    with pytest.raises(CapsuleError, match="cannot read"):
        read(capsule)


def test_a_pipe_for_an_index_is_refused(capsule: Path) -> None:
    (capsule / INDEX).unlink()
    os.mkfifo(capsule / INDEX)
    with pytest.raises(CapsuleError, match="it is not a file"):
        read(capsule)


def test_a_name_that_is_not_utf_8_gets_no_index(tmp_path: Path) -> None:
    (filled(tmp_path) / os.fsdecode(b"a\xff")).touch()
    with pytest.raises(CapsuleError, match="no index for"):
        write(tmp_path, ABOUT)


def test_a_folder_without_an_index_is_no_capsule(tmp_path: Path) -> None:
    with pytest.raises(CapsuleError, match=r"is not a capsule: it has no index\.json") as refused:
        read(tmp_path / "none")
    assert "swarmctl run" in refused.value.help


def test_an_index_that_fails_leaves_the_old_one(capsule: Path) -> None:
    before = (capsule / INDEX).read_bytes()
    with pytest.raises(CapsuleError, match="outcome"):
        write(capsule, ABOUT | {"outcome": "great"})
    (capsule / "bags/a\nb").touch()
    with pytest.raises(CapsuleError, match=r"bags/a\\nb"):
        write(capsule, ABOUT)
    assert (capsule / INDEX).read_bytes() == before


def test_a_new_index_ends_the_old_signature(capsule: Path) -> None:
    (capsule / SIGNATURE).write_text("of the old one")
    (capsule / ".index.json.new").write_text("of a power cut")
    write(capsule, ABOUT)
    assert problems(capsule) == ()
    assert not (capsule / SIGNATURE).exists()


def test_a_folder_that_nobody_can_write_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(CapsuleError, match="cannot write"):
        write(tmp_path / "missing", ABOUT)


def test_others_can_read_the_index(capsule: Path) -> None:
    mask = os.umask(0)
    os.umask(mask)
    assert stat.S_IMODE((capsule / INDEX).stat().st_mode) == 0o666 & ~mask


def test_capsules_are_found_two_folders_below(tmp_path: Path) -> None:
    for place in ("b", "a/2", "a/1", "a/1/bags", "x/y/z"):
        (tmp_path / place).mkdir(parents=True)
        (tmp_path / place / INDEX).touch()
    (tmp_path / "link").symlink_to(tmp_path / "b")
    assert below(tmp_path) == [tmp_path / "a/1", tmp_path / "a/2", tmp_path / "b"]
    assert below(tmp_path / "b") == [tmp_path / "b"]
    assert below(tmp_path / "none") == []
