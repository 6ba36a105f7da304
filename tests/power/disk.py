"""A file system in an image: its state on the disk at any instant, and the cut of its power.

What a power cut leaves is what the file system had sent to its device by then. That is the content of the
image; so a copy of the image, taken while nobody runs, is a cut. ``cut`` is one on the mounted file system
itself: the shutdown ioctl, after which it sends nothing more.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import subprocess
import time
from pathlib import Path
from typing import NamedTuple

from tests.timing import PATIENCE

_SIZE = 48 << 20
_CHUNK = 32 << 10
_SHUTDOWN = 0x8004587D  # _IOR('X', 125, __u32)
#: What a cut leaves of the changes that wait in the log: all (the log is flushed first), none, or what came
#: before one instant, at which the kernel had written all, as it does every few seconds. The numbers are the
#: shutdown ioctl's.
LOGS = {"flushed": 1, "lost": 2, "once": 2}


class FileSystem(NamedTuple):
    """How it is made and mounted; ``cuts``: it has the shutdown ioctl."""

    make: tuple[str, ...]
    options: str
    cuts: bool


#: ext4 as Raspberry Pi OS has it on SD cards (blocks of 4 KiB, data=ordered, noatime).
FILE_SYSTEMS = {
    "ext4": FileSystem(("mkfs.ext4", "-q", "-b", "4096", "-J", "size=4"), "noatime,data=ordered", True),
    "xfs": FileSystem(("mkfs.xfs", "-q", "--unsupported"), "noatime", True),
    "btrfs": FileSystem(("mkfs.btrfs", "-q", "--mixed"), "noatime", False),
}


def missing(name: str) -> str:
    """Returns what this machine lacks for a file system; empty if nothing."""
    program = FILE_SYSTEMS[name].make[0]
    if f"\t{name}\n" not in Path("/proc/filesystems").read_text():
        return f"{name} in the kernel"
    return "" if shutil.which(program, path=_path()) else program


Snapshot = dict[int, bytes]  # the chunks of an image that are not zero, by their offset


class Disk:
    """An image and where it is mounted. In a mount namespace of its own nothing outlives the process."""

    def __init__(self, folder: Path, kind: str) -> None:
        self.kind = kind
        self.system = FILE_SYSTEMS[kind]
        self.image = folder / "image"
        self.mount = folder / "mount"
        self.mount.mkdir()
        self._chunks: dict[bytes, bytes] = {}
        with self.image.open("wb") as file:
            file.truncate(_SIZE)
        _run(*self.system.make, str(self.image))

    def attach(self) -> None:
        """Mounts the image; the file system replays its log."""
        _run("mount", "-o", f"loop,{self.system.options}", str(self.image), str(self.mount))

    def detach(self) -> None:
        """Unmounts it, once the last process has closed its files."""
        end = time.monotonic() + PATIENCE
        while subprocess.run(["umount", str(self.mount)], capture_output=True, check=False).returncode:
            if time.monotonic() > end:
                _run("umount", str(self.mount))
            time.sleep(0.002)

    def flush_log(self) -> None:
        """Sends what waits in the log to the device, and no data of files."""
        with (self.mount / "tick").open("ab") as file:
            os.utime(file.fileno())
            os.fsync(file.fileno())

    def write_all(self) -> None:
        """Sends everything to the device."""
        _run("sync", "--file-system", str(self.mount))

    def cut(self, log: str) -> None:
        """Cuts the power of the mounted file system."""
        folder = os.open(self.mount, os.O_RDONLY)
        try:
            fcntl.ioctl(folder, _SHUTDOWN, LOGS[log].to_bytes(4, "little"))
        finally:
            os.close(folder)

    def snapshot(self) -> Snapshot:
        """Returns what the device has now; again if the kernel wrote meanwhile."""
        while True:
            before = self.image.stat().st_mtime_ns
            found = self._read()
            if self.image.stat().st_mtime_ns == before:
                return found

    def restore(self, snapshot: Snapshot) -> None:
        """Makes the image, which is not mounted, that of ``snapshot``."""
        self.image.unlink()
        with self.image.open("wb") as file:
            file.truncate(_SIZE)
            for offset, chunk in snapshot.items():
                os.pwrite(file.fileno(), chunk, offset)

    def _read(self) -> Snapshot:
        found: Snapshot = {}
        with self.image.open("rb") as file:
            number, offset = file.fileno(), 0
            while offset < _SIZE:
                try:
                    start = os.lseek(number, offset, os.SEEK_DATA)
                except OSError:  # no data after ``offset``
                    break
                end = os.lseek(number, start, os.SEEK_HOLE)
                for place in range(start - start % _CHUNK, end, _CHUNK):
                    chunk = os.pread(number, _CHUNK, place)
                    found[place] = self._chunks.setdefault(chunk, chunk)
                offset = end
        return found


def identity(snapshot: Snapshot) -> tuple[tuple[int, int], ...]:
    """Returns the same for equal images of one ``Disk``: equal images, equal futures."""
    return tuple((offset, id(chunk)) for offset, chunk in snapshot.items())


def _path() -> str:
    return "{}:/usr/sbin:/sbin".format(os.environ.get("PATH", "/usr/bin:/bin"))


def _run(*command: str) -> None:
    subprocess.run(command, check=True, capture_output=True, env={**os.environ, "PATH": _path()})
