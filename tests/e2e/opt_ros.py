"""Runs on a host: moves its ROS from Debian's folders to /opt/ros/noetic, as ROS packages lay it out."""

import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

TARGET = Path("/opt/ros/noetic")
LIBRARIES = "/usr/lib/x86_64-linux-gnu/"
LEFT = ("/doc/", "/man/", "/include/")
OF_DEBIAN = ("python3-rospkg", "python3-catkin-pkg")  # under /usr on Ubuntu too
PACKAGE_OF_ROS = ("python3-ros", "python3-gen", "python3-tf", "python3-catkin", "libros", "rosout", "rospack")
PACKAGE = """<package format="2"><name>setup</name><version>1.0.0</version><description>d</description>
<maintainer email="a@b.example">a</maintainer><license>MIT</license>
<buildtool_depend>catkin</buildtool_depend></package>
"""
CMAKE = (
    "cmake_minimum_required(VERSION 3.0)\nproject(setup)\nfind_package(catkin REQUIRED)\ncatkin_package()\n"
)


def install_setup_files(folder: Path) -> None:
    """catkin writes setup.sh, setup.bash and _setup_util.py of the target, as it does for every install."""
    folder.mkdir()
    (folder / "package.xml").write_text(PACKAGE)
    (folder / "CMakeLists.txt").write_text(CMAKE)
    for argv in (["cmake", f"-DCMAKE_INSTALL_PREFIX={TARGET}", "."], ["make", "install"]):
        subprocess.run(argv, cwd=folder, check=True, stdout=subprocess.DEVNULL)


def paths_of_ros() -> Iterator[str]:
    """Yields the files of Debian's packages that are of ROS, without headers and manuals."""
    query = ["dpkg-query", "-W", "-f", "${Package}\n"]
    for name in subprocess.run(query, stdout=subprocess.PIPE, text=True, check=True).stdout.split():
        listed = subprocess.run(["dpkg", "-L", name], stdout=subprocess.PIPE, text=True, check=False)
        paths = listed.stdout.splitlines()
        is_package = any(one.startswith("/usr/share/") and one.endswith("/package.xml") for one in paths)
        if name not in OF_DEBIAN and (is_package or name.startswith(PACKAGE_OF_ROS)):
            yield from (one for one in paths if not any(part in one for part in LEFT))


def has_files(folder: Path) -> bool:
    """Compiled modules, which no package of Debian lists, do not count."""
    return any(files for place, _, files in os.walk(folder) if not place.endswith("__pycache__"))


def main() -> None:
    install_setup_files(Path("/tmp/setup"))
    for path in paths_of_ros():
        if Path(path).is_dir() or not os.path.lexists(path) or not path.startswith(("/usr/", "/etc/catkin/")):
            continue
        inner = f"lib/{path[len(LIBRARIES) :]}" if path.startswith(LIBRARIES) else path[1:]
        place = TARGET / (inner[4:] if inner.startswith("usr/") else inner)
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.move(path, place)
    for folder in ("/usr/share", "/usr/lib", "/usr/lib/python3/dist-packages"):
        for one in Path(folder).iterdir():
            if one.is_dir() and not one.is_symlink() and not has_files(one):
                shutil.rmtree(one)
    shutil.rmtree("/usr/share/ros", ignore_errors=True)
    for hook in (TARGET / "etc/catkin/profile.d").iterdir():
        hook.write_text(hook.read_text().replace("Debian", "noetic").replace("debian", "noetic"))


main()
