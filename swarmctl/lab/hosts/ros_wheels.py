"""ROS 2 in a disk image: wheels from PyPI, pinned by hash, laid out like an installed ROS.

A distro has an image with ROS 2 if its requirements file is shipped; of the others this knows nothing.
"""

from __future__ import annotations

import platform
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path, PurePosixPath
from zipfile import ZipFile, ZipInfo

from swarmctl import resources
from swarmctl.lab.errors import LabError

PYTHON = "3.11"  # that of the image's Debian
SITE = f"lib/python{PYTHON}/site-packages"
MACHINE = "x86_64"  # no other has wheels
PLATFORM = f"manylinux_2_28_{MACHINE}"
#: What the wheels need of Debian.
PACKAGES = ("python3-numpy", "python3-psutil", "python3-typing-extensions", "python3-yaml")
#: What compiles tf2_msgs, of which there is no wheel, elsewhere than in the image.
COMPILERS = ("g++", "libc6-dev", "python3-dev", "python3-empy", "python3-lark", "python3-numpy")
GENERATORS, SCRIPT = "generators", "tf2_msgs.py"
#: Of a package that CMake alone builds, such as Fast DDS: its wheel has none.
MANIFEST = "<package><name>{name}</name></package>\n"
SETUP_FILES = ("setup.sh", "setup.bash", "local_setup.sh", "local_setup.bash")


class NoWheelsError(LabError):
    """This machine cannot have the wheels."""

    def __init__(self, distro: str, why: str, *help_lines: str) -> None:
        super().__init__(
            f"no lab with ROS 2 {distro} here: {why}",
            *help_lines,
            "labs of ROS 1 work without: all that they need is from Debian",
        )


def exist_for(distro: str) -> bool:
    """Returns whether ROS of this distro comes from wheels."""
    return _requirements(distro).is_file()


def recipe(distro: str) -> tuple[str, ...]:
    """Returns all that decides what ``install`` puts into an image."""
    return (
        _requirements(distro).read_text("utf-8"),
        _requirements(distro, GENERATORS).read_text("utf-8"),
        _script().read_text("utf-8"),
        *COMPILERS,
        setup_text(distro),
        *SETUP_FILES,
        MANIFEST,
        PYTHON,
        PLATFORM,
    )


def _requirements(distro: str, what: str = "ros2") -> Path:
    return resources.templates() / "lab" / f"{what}-{distro}.txt"


def _script() -> Path:
    return resources.templates() / "lab" / SCRIPT


def _prefix(distro: str) -> PurePosixPath:
    return PurePosixPath("opt/ros", distro)


def setup_text(distro: str) -> str:
    """Returns the setup file, which a shell sources."""
    text = (resources.templates() / "lab/ros2-setup.sh").read_text("utf-8")
    for name, value in (("DISTRO", distro), ("PREFIX", f"/{_prefix(distro)}"), ("SITE", SITE)):
        text = text.replace(f"@{name}@", value)
    return text


def download(distro: str, folder: Path) -> None:
    """Downloads the wheels of a distro into ``folder``, its generators into a folder below, by pip.

    Raises ``NoWheelsError``, and ``LabError`` if a wheel is another one than was pinned.
    """
    if (machine := platform.machine()) != MACHINE:
        raise NoWheelsError(distro, f"its wheels are for {MACHINE}, and this machine is {machine}")
    if find_spec("pip") is None:
        raise NoWheelsError(distro, f"{sys.executable} has no pip", f"{sys.executable} -m ensurepip")
    argv = (
        *(sys.executable, "-m", "pip", "download", "-qq", "--disable-pip-version-check", "--no-input"),
        *("--no-deps", "--require-hashes", "--only-binary=:all:", "--implementation=cp"),
        *(f"--python-version={PYTHON}", f"--platform={PLATFORM}"),
    )
    for place, what in ((folder, "ros2"), (folder / GENERATORS, GENERATORS)):
        _pip((*argv, f"--dest={place}", f"--requirement={_requirements(distro, what)}"), distro)


def _pip(argv: Sequence[str], distro: str) -> None:
    done = subprocess.run(argv, capture_output=True, text=True, stdin=subprocess.DEVNULL, check=False)
    if "DO NOT MATCH THE HASHES" in done.stderr:
        raise LabError(f"wheels of ROS 2 {distro} are not those that were pinned", *done.stderr.splitlines())
    if done.returncode != 0:
        raise NoWheelsError(distro, "pip cannot download its wheels", *done.stderr.strip().splitlines()[-4:])


def install(distro: str, wheels: Path, image: Path) -> None:
    """Unpacks ``wheels`` into an image, and writes the setup files beside them."""
    prefix = image / _prefix(distro)
    for wheel in sorted(wheels.glob("*.whl")):
        with ZipFile(wheel) as archive:
            for member, place in _members(archive):
                file = prefix / place
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_bytes(archive.read(member))
                file.chmod(0o755 if member.external_attr >> 16 & 0o100 else 0o644)
    for name in SETUP_FILES:
        (prefix / name).write_text(setup_text(distro))
    for build_files in (prefix / "share").glob("*/cmake"):
        manifest = build_files.with_name("package.xml")
        if not manifest.exists():
            manifest.write_text(MANIFEST.format(name=manifest.parent.name))


def install_generators(distro: str, wheels: Path, builder: Path) -> None:
    """Does what ``install`` does for a place in which tf2_msgs is compiled, with what that needs."""
    install(distro, wheels, builder)
    install(distro, wheels / GENERATORS, builder)
    shutil.copy(_script(), builder)


def messages_argv(distro: str, builder: Path) -> tuple[str, ...]:
    """Returns the command that generates and compiles tf2_msgs in ``builder``."""
    return ("chroot", str(builder), "/usr/bin/python3", f"/{SCRIPT}", f"/{_prefix(distro)}", "/built")


def install_messages(distro: str, builder: Path, image: Path) -> None:
    """Copies what ``messages_argv`` has compiled into an image."""
    shutil.copytree(builder / "built", image / _prefix(distro), dirs_exist_ok=True)


def compile_argv(distro: str, image: Path) -> tuple[str, ...]:
    """Returns the command that compiles the modules: accounts of hosts cannot, and would at each start."""
    return (
        *("chroot", str(image), "/usr/bin/python3", "-I", "-m", "compileall", "-q"),
        f"/{_prefix(distro) / SITE}",
    )


def _members(archive: ZipFile) -> Iterator[tuple[ZipInfo, PurePosixPath]]:
    """The files of a wheel, each with its place below the prefix.

    ``NAME.data/data`` is the prefix itself. Libraries that auditwheel has put beside it lie in ``lib``, where
    LD_LIBRARY_PATH finds them; their names contain a hash.
    """
    for member in archive.infolist():
        path = PurePosixPath(member.filename)
        if member.is_dir():
            continue
        if path.parts[0].endswith(".data"):
            yield member, PurePosixPath(*path.parts[2:])
        elif path.parts[0].endswith(".libs"):
            yield member, PurePosixPath("lib", *path.parts[1:])
        else:
            yield member, PurePosixPath(SITE, path)
