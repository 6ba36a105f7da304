"""The disk that all lab hosts start from: Debian with systemd, sshd and ROS 1. Cached by its recipe."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import subprocess
import tempfile
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

from swarmctl.lab import places
from swarmctl.lab.errors import LabError
from swarmctl.lab.processes import environment, require, sealed

SUITE = "bookworm"
KEYRING = Path("/usr/share/keyrings/debian-archive-keyring.gpg")
RECIPE = 1  # raise it when ``finish`` changes
PACKAGES = (
    *(
        "systemd",
        "systemd-sysv",
        "dbus",
        "openssh-server",
        "iproute2",
        "iputils-ping",
        "python3",
        "python3-serial",
    ),
    *("nftables", "procps", "sudo", "chrony"),
    *("python3-roslaunch", "python3-rospy", "python3-rostopic", "python3-rosnode", "python3-rosparam"),
    *(
        "python3-rosmaster",
        "python3-geometry-msgs",
        "python3-nav-msgs",
        "python3-sensor-msgs",
        "python3-std-msgs",
    ),
    *("python3-diagnostic-msgs", "python3-tf2-msgs", "rospack-tools"),
    *("python3-std-srvs", "ros-std-srvs"),
    "avrdude",
    "ros-environment",  # what the setup files of a workspace run
)
MASKED = (
    *("apt-daily.timer", "apt-daily-upgrade.timer", "e2scrub_all.timer", "dpkg-db-backup.timer"),
    "console-getty.service",
)
# What a build leaves of the machine it ran on, and what every host gets of its own.
STRANGERS = ("etc/hostname", "etc/resolv.conf", "etc/ssh/ssh_host_*")

SAY_EVERY = 3.0  # s, while packages come and go

Say = Callable[[str], None]
Build = Callable[[Path, Say], None]


def digest() -> str:
    """The name of the image: it changes with everything that goes into it."""
    recipe = [RECIPE, SUITE, PACKAGES, MASKED, STRANGERS]
    return hashlib.sha256(json.dumps(recipe).encode()).hexdigest()[:12]


def bootstrap_argv(directory: Path) -> tuple[str, ...]:
    packages = ",".join(PACKAGES)
    return ("mmdebstrap", "--verbose", "--variant=minbase", f"--include={packages}", SUITE, str(directory))


def ensured(say: Say) -> Path:
    """The image, built now if it is not in the cache."""
    image = places.cache() / f"image-{digest()}"
    return image if image.is_dir() else cached(image, build, say)


def cached(image: Path, make: Build, say: Say) -> Path:
    """``image``, made by ``make`` unless it is there: whole or not at all; of two makers one waits."""
    folder = image.parent
    folder.mkdir(parents=True, exist_ok=True)
    with places.locked(folder / f".{image.name}.lock", patience=900.0):
        if image.is_dir():
            return image
        for stale in folder.glob(f".{image.name}.new-*"):
            shutil.rmtree(stale)
        fresh = Path(tempfile.mkdtemp(prefix=f".{image.name}.new-", dir=folder))
        try:
            fresh.chmod(0o755)
            make(fresh, say)
            fresh.rename(image)
        finally:
            shutil.rmtree(fresh, ignore_errors=True)
    return image


def build(directory: Path, say: Say) -> None:
    """Bootstrap the image into an empty ``directory``. Takes the better part of a minute."""
    require("mmdebstrap", "unshare", "setpriv")
    if not KEYRING.exists():
        raise LabError("the keys of the Debian archive are missing", "apt-get install debian-archive-keyring")
    _bootstrap(sealed(bootstrap_argv(directory)), say)
    finish(directory)


def _bootstrap(argv: Sequence[str], say: Say) -> None:
    # Its mounts and processes end with us: a half-built image must not hold the machine's /dev when removed.
    with subprocess.Popen(
        ("setpriv", "--pdeathsig", "KILL", *argv),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=environment(),
    ) as process:
        assert process.stdout is not None
        last: deque[str] = deque(maxlen=8)
        try:
            for told in progress(_kept(process.stdout, last)):
                say(told)
        except BaseException:
            process.kill()
            process.stdout.read()  # until the last of its processes has let go of the image
            raise
    if process.returncode != 0:
        raise LabError(f"mmdebstrap ended with status {process.returncode}", *last)


def _kept(lines: Iterable[str], last: deque[str]) -> Iterator[str]:
    for line in lines:
        last.append(line.rstrip())
        yield line


def progress(lines: Iterable[str], clock: Callable[[], float] = time.monotonic) -> Iterator[str]:
    """What to tell of mmdebstrap's talk: its own steps all, apt's and dpkg's every few seconds."""
    said, done, steps = clock(), 0, 1
    for line in lines:
        if line.startswith("I: "):
            said = clock()
            yield line[3:].strip()
        elif found := re.search(r"(\d+) newly installed", line):
            done, steps = 0, 2 * int(found[1])
        elif found := re.match(r"(Unpacking|Setting up) ([^ :]+)", line):
            done += 1
            if clock() - said >= SAY_EVERY:
                said = clock()
                yield f"{done * 100 // steps:3d} %  {found[1].lower()} {found[2]}"


def finish(directory: Path) -> None:
    """Make of a bare Debian what a lab host starts from: sshd enabled, nothing of the build machine left."""
    for pattern in STRANGERS:
        for stranger in directory.glob(pattern):
            stranger.unlink()
    (directory / "etc/resolv.conf").write_text("")
    (directory / "etc/machine-id").write_text("")
    units = directory / "etc/systemd/system"
    for unit in MASKED:
        _link(units / unit, "/dev/null")
    _link(units / "multi-user.target.wants/ssh.service", "/lib/systemd/system/ssh.service")


def _link(path: Path, target: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.unlink(missing_ok=True)
    path.symlink_to(target)
