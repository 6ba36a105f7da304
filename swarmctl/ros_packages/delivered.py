"""Decides whether a folder is a ROS package that can travel with a release, and whether it must be built."""

from __future__ import annotations

import re
from collections.abc import Mapping

from swarmctl.ros_packages.package import MANIFEST, DeliveredPackage, Package, package_of
from swarmctl.ros_packages.package_manifest import faults_of
from swarmctl.ros_packages.xml_tags import root_of

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
