"""The disk image of lab hosts: Debian with systemd, sshd and ROS. Cached by a digest of its recipe."""

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
from functools import partial
from pathlib import Path

from swarmctl.lab import paths
from swarmctl.lab.errors import LabError
from swarmctl.lab.hosts import containers, ros_wheels
from swarmctl.lab.hosts.processes import environment, isolated, require, run

SUITE = "bookworm"
DISTRIBUTION = "debian-12"  # as its os-release has it
KEYRING = Path("/usr/share/keyrings/debian-archive-keyring.gpg")
RECIPE = 1  # increment it when ``finish`` or ``ros_wheels.install`` changes
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
    *("nftables", "procps", "sudo", "chrony", "avrdude"),
    *("wireguard-tools", "wireguard-go"),
)
#: ROS 1, of Debian; a distro of ``ros_wheels`` has these packages in place of it.
ROS_1 = (
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
    *("python3-roswtf", "ros-robot-state-publisher", "python3-rosbag"),  # what people look at a swarm with
    "ros-environment",  # used by the setup files of a workspace
    *("libroscpp4d", "libtf1d", "python3-tf", "python3-actionlib"),  # loaded by nodes of a workspace
)
#: What a lab has besides if packages of its spec are built.
COMPILERS = (
    *("catkin", "g++", "make", "libroscpp-dev", "ros-message-generation", "ros-message-runtime"),
    *("libstd-msgs-dev", "libgeometry-msgs-dev", "libsensor-msgs-dev", "libnav-msgs-dev", "libtf2-ros-dev"),
)
MASKED = (
    *("apt-daily.timer", "apt-daily-upgrade.timer", "e2scrub_all.timer", "dpkg-db-backup.timer"),
    "console-getty.service",
)
# Files of the build machine, and files that every host gets of its own.
BUILD_LEFTOVERS = ("etc/hostname", "etc/resolv.conf", "etc/ssh/ssh_host_*")

REPORT_EVERY = 3.0  # s, while packages are installed

Progress = Callable[[str], None]
Build = Callable[[Path, Progress], None]


def digest(more: tuple[str, ...] = (), distro: str = "") -> str:
    """Returns the digest of the recipe, which names the image; ``more``: packages beside the usual ones."""
    recipe: list[object] = [RECIPE, SUITE, (*_packages(distro), *more), MASKED, BUILD_LEFTOVERS]
    if settings := containers.settings_of(more):
        recipe.append(dict(settings))
    if ros_wheels.exist_for(distro):
        recipe.append(ros_wheels.recipe(distro))
    return hashlib.sha256(json.dumps(recipe).encode()).hexdigest()[:12]


def _packages(distro: str) -> tuple[str, ...]:
    return (*PACKAGES, *(ros_wheels.PACKAGES if ros_wheels.exist_for(distro) else ROS_1))


def bootstrap_argv(directory: Path, more: tuple[str, ...] = (), distro: str = "") -> tuple[str, ...]:
    """Returns the mmdebstrap command."""
    return _mmdebstrap(directory, (*_packages(distro), *more))


def _mmdebstrap(directory: Path, packages: Sequence[str]) -> tuple[str, ...]:
    include = f"--include={','.join(packages)}"
    return ("mmdebstrap", "--verbose", "--variant=minbase", include, SUITE, str(directory))


def ensure(
    progress_to: Progress, *, distro: str = "", compilers: bool = False, engines: Sequence[str] = ()
) -> Path:
    """Returns the path of the image, which is built if it is not in the cache. Raises ``LabError``.

    ``distro``: of ROS; one without wheels has ROS 1. ``compilers``: an image of its own in which packages can
    be built; ``engines``: one that runs containers.
    """
    more = _more(distro, compilers, engines)
    image = paths.cache() / f"image-{digest(more, distro)}"
    make = partial(build, more=more, distro=distro)
    return image if image.is_dir() else build_once(image, make, progress_to)


def _more(distro: str, compilers: bool, engines: Sequence[str]) -> tuple[str, ...]:
    catkin = compilers and not ros_wheels.exist_for(distro)
    return (*(COMPILERS if catkin else ()), *containers.packages_of(engines))


def build_once(image: Path, make: Build, progress_to: Progress) -> Path:
    """Returns ``image``, built by ``make`` if missing: atomically, and by one process at a time."""
    folder = image.parent
    folder.mkdir(parents=True, exist_ok=True)
    with paths.locked(folder / f".{image.name}.lock", timeout=900.0):
        if image.is_dir():
            return image
        for stale in folder.glob(f".{image.name}.new-*"):
            shutil.rmtree(stale)
        fresh = Path(tempfile.mkdtemp(prefix=f".{image.name}.new-", dir=folder))
        try:
            fresh.chmod(0o755)
            make(fresh, progress_to)
            fresh.rename(image)
        finally:
            shutil.rmtree(fresh, ignore_errors=True)
    return image


def build(directory: Path, progress_to: Progress, more: tuple[str, ...] = (), distro: str = "") -> None:
    """Bootstraps the image into an empty ``directory``, in about a minute. Raises ``LabError``."""
    require("mmdebstrap", "unshare", "setpriv")
    if not KEYRING.exists():
        raise LabError(
            "the keyring of the Debian archive is missing", "apt-get install debian-archive-keyring"
        )
    with tempfile.TemporaryDirectory() as wheels:
        if ros_wheels.exist_for(distro):
            progress_to("downloading ROS from PyPI")
            ros_wheels.download(distro, Path(wheels))
        _bootstrap(isolated(bootstrap_argv(directory, more, distro)), progress_to)
        if ros_wheels.exist_for(distro):
            ros_wheels.install(distro, Path(wheels), directory)
            _compile_messages(distro, Path(wheels), directory, progress_to)
            run(isolated(ros_wheels.compile_argv(distro, directory)))
    finish(directory)
    for path, content in containers.settings_of(more).items():
        (directory / path).parent.mkdir(parents=True, exist_ok=True)
        (directory / path).write_text(content)


def _compile_messages(distro: str, wheels: Path, image: Path, progress_to: Progress) -> None:
    """Adds the messages that are compiled; the compiler is in a place of its own, which is removed."""
    with tempfile.TemporaryDirectory(prefix=f"{image.name}-builder-", dir=image.parent) as place:
        progress_to("compiling tf2_msgs")
        builder = Path(place)
        _bootstrap(isolated(_mmdebstrap(builder, ros_wheels.COMPILERS)), progress_to)
        ros_wheels.install_generators(distro, wheels, builder)
        run(isolated(ros_wheels.messages_argv(distro, builder)))
        ros_wheels.install_messages(distro, builder, image)


def _bootstrap(argv: Sequence[str], progress_to: Progress) -> None:
    # Its mounts and processes end with ours: a half-built image can then be removed safely.
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
            for line in progress(_kept(process.stdout, last)):
                progress_to(line)
        except BaseException:
            process.kill()
            process.stdout.read()  # until its last process has ended
            raise
    if process.returncode != 0:
        raise LabError(f"mmdebstrap ended with status {process.returncode}", *last)


def _kept(lines: Iterable[str], last: deque[str]) -> Iterator[str]:
    for line in lines:
        last.append(line.rstrip())
        yield line


def progress(lines: Iterable[str], clock: Callable[[], float] = time.monotonic) -> Iterator[str]:
    """Filters the output of mmdebstrap: all of its own steps, a line for apt and dpkg every few seconds."""
    reported, done, steps = clock(), 0, 1
    for line in lines:
        if line.startswith("I: "):
            reported = clock()
            yield line[3:].strip()
        elif found := re.search(r"(\d+) newly installed", line):
            done, steps = 0, 2 * int(found[1])
        elif found := re.match(r"(Unpacking|Setting up) ([^ :]+)", line):
            done += 1
            if clock() - reported >= REPORT_EVERY:
                reported = clock()
                yield f"{done * 100 // steps:3d} %  {found[1].lower()} {found[2]}"


def finish(directory: Path) -> None:
    """Turns a bare Debian into a lab image: sshd enabled, files of the build machine removed."""
    for pattern in BUILD_LEFTOVERS:
        for leftover in directory.glob(pattern):
            leftover.unlink()
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
