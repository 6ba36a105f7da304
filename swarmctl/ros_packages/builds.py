"""Which builds of delivered packages a platform needs, each named by all that it is made of."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from hashlib import sha256

from swarmctl.ros_packages.package import DeliveredPackage

#: What a build made of a package, for ``lib`` of a catkin space: content and permission to execute by path.
Built = Mapping[str, tuple[bytes, bool]]

_ROS = re.compile(r"-[a-z]+-[0-9][0-9.]*$")
RECIPE = 2  # increment it when the agent builds otherwise
_SOURCES = (".c", ".cc", ".cpp", ".cxx", ".cu", ".h", ".hh", ".hpp", ".hxx", ".tpp", ".ipp")


def with_dependencies(
    names: Iterable[str], packages: Mapping[str, DeliveredPackage]
) -> tuple[DeliveredPackage, ...]:
    """Returns the ``packages`` of these names and those that they depend on, by name."""
    found: dict[str, DeliveredPackage] = {}
    due = list(names)
    while due:
        one = packages.get(due.pop())
        if one is not None and one.name not in found:
            found[one.name] = one
            due += sorted(one.depends)
    return tuple(found[name] for name in sorted(found))


def build_key(name: str, packages: Mapping[str, DeliveredPackage], distro: str, platform: str) -> str:
    """Returns the name of the build of a package: a digest of its sources and of those it depends on.

    ``distro``: the ROS distribution; ``platform``: as the agent reports it, with the version of ROS, such as
    ``debian-12-x86_64-ros-1.15.15``.
    """
    total = sha256(f"{RECIPE} {distro} {platform} {name}\n".encode())
    for one in with_dependencies([name], packages):
        total.update(f"{one.name} {one.digest}\n".encode())
    return total.hexdigest()


def without_ros(platform: str) -> str:
    """Returns the distribution and machine of a platform; the platform itself if it names no ROS."""
    return _ROS.sub("", platform)


def runtime_files(package: DeliveredPackage) -> Iterable[tuple[str, tuple[bytes, bool]]]:
    """Yields the files of a package that its programs read: of one that is built, all but its sources."""
    for path, file in package.files.items():
        if not package.built_by or not (path.endswith(_SOURCES) or path == "CMakeLists.txt"):
            yield path, file
