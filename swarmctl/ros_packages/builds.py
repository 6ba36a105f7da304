"""Packages that travel with a release: which folders they are, and the builds that a platform needs."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from hashlib import sha256

from swarmctl.ros_packages.package import MANIFEST, DeliveredPackage, Package, package_of
from swarmctl.ros_packages.package_manifest import faults_of
from swarmctl.ros_packages.xml_tags import root_of

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


#: What only a build makes of a package: executables, libraries, messages, settings of dynamic_reconfigure.
_BUILDS = re.compile(
    rb"^[^#\n]*\b(\w*add_executable|\w*add_library|pybind_add_module|pybind11_add_module|generate_messages"
    rb"|generate_dynamic_reconfigure_options)\s*\(",
    re.MULTILINE | re.I,
)


def delivered_package(
    name: str, folder: str, files: Mapping[str, tuple[bytes, bool]]
) -> DeliveredPackage | str:
    """Returns the package called ``name`` with these files, or why it cannot be delivered.

    ``folder``: where it lies, as messages show it.
    """
    if MANIFEST not in files:
        return f"has no {MANIFEST}"
    listing = {path: may for path, (_, may) in files.items()}
    package: Package | None = package_of("", listing, {MANIFEST: files[MANIFEST][0]})
    if package is None:
        return f"has a {MANIFEST} that names no package"
    if package.name != name:
        return f"holds the package {package.name}"
    if fault := next(faults_of(root_of(files[MANIFEST][0])), None):
        return f"has a {MANIFEST} that catkin refuses: it {fault}"
    found = _BUILDS.search(files.get("CMakeLists.txt", (b"", False))[0])
    return DeliveredPackage(
        name,
        files,
        package.depends,
        found[1].decode() if found else "",
        package.to_build,
        package.to_run,
        folder,
    )
