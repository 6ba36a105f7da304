"""A disk without a free inode, a real ext4: the old release runs, and the error names what is missing."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import replace
from itertools import count
from pathlib import Path

import pytest

from tests.onboard.agent import fakehost
from tests.onboard.agent.fakehost import FakeHost, bundle
from tests.power import isolated

LACKS = isolated.missing()
pytestmark = pytest.mark.skipif(bool(LACKS), reason=f"an image needs {LACKS}")

OLD = bundle("1")
NEW = replace(bundle("2", units=("master", "khepera"), hosts="10.0.0.2 pi\n"), secrets=("mqtt",))
CHANGE = {
    "previous": OLD.digest,
    "stop": ["koala.service"],
    "restart": ["master.service"],
    "start": ["khepera.service"],
}
UNCHECKED = fakehost.BOOT.replace(
    "from swarm_onboard.agent.main",
    "from swarm_onboard.agent import staging; staging.check_space = lambda *_: None; "
    "from swarm_onboard.agent.main",
)


@pytest.fixture
def small(tmp_path: Path) -> Iterator[Path]:
    """A mounted ext4 with 256 inodes and much space."""
    image, mount = tmp_path / "image", tmp_path / "mount"
    mount.mkdir()
    with image.open("wb") as file:
        file.truncate(16 << 20)
    path = f"{os.environ['PATH']}:/usr/sbin:/sbin"
    subprocess.run(["mkfs.ext4", "-q", "-N", "256", str(image)], check=True, env={"PATH": path})
    subprocess.run(["mount", "-o", "loop", str(image), str(mount)], check=True)
    try:
        yield mount
    finally:
        subprocess.run(["umount", str(mount)], check=True)


def leave(place: Path, inodes: int) -> None:
    """Takes or gives inodes until that many are free."""
    place.mkdir(exist_ok=True)
    taken = sorted(place.iterdir())
    while (free := os.statvfs(place).f_favail) != inodes:
        if free > inodes:
            made = place / f"{len(taken):05}"
            made.touch()
            taken.append(made)
        else:
            taken.pop().unlink()


def test_without_inodes_nothing_is_written(small: Path) -> None:
    host = FakeHost(small / "host")
    assert host.apply(OLD).answer
    leave(small / "bags", 30)

    reply = host.apply(NEW, secrets={"mqtt": "hunter2"}, **CHANGE)

    assert reply.error == {
        "kind": "refused",
        "message": f"the disk has no inodes left: 30 in {small}",
        "hint": f"remove files from {small}",
    }
    leave(small / "bags", 0)
    lease = host.ask({"verb": "lease", "swarm": "new", "want": True, "run": "0" * 16})
    assert f"the disk has no inodes left: 0 in {small}" in lease.error["message"]
    assert host.units() == dict.fromkeys(("master.service", "koala.service"), OLD.digest)


def test_wherever_inodes_run_out_the_old_release_runs(small: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Other programs take them after the host was found fit: a bag of a camera, for one."""
    monkeypatch.setattr(fakehost, "BOOT", UNCHECKED)
    host = FakeHost(small / "host")
    assert host.apply(OLD).answer
    before = host.outside()

    for free in count():
        leave(small / "bags", free)
        reply = host.apply(NEW, secrets={"mqtt": "hunter2"}, **CHANGE)
        if not reply.error:
            break
        print(free, reply.error["message"])
        assert "the disk has no inodes left: " in reply.error["message"], (free, reply)
        seen = host.observe()
        assert (seen.release, seen.staging, host.outside()) == (OLD.digest, [], before)
        shutil.rmtree(host.prefix / f"opt/swarm/new/releases/{NEW.digest}", ignore_errors=True)
        assert host.units() == dict.fromkeys(("master.service", "koala.service"), OLD.digest)

    assert free > len(NEW.files)
    assert host.units() == dict.fromkeys(("master.service", "khepera.service"), NEW.digest)
