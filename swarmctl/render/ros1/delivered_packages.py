"""The users' own packages in a release: their files, their builds, and where ROS and Python find them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from swarmctl.render.bundle import ROOT, File
from swarmctl.ros_packages.builds import Built, build_key, runtime_files
from swarmctl.ros_packages.package import DeliveredPackage
from swarmctl.swarm.resolved import Host, Swarm
from swarmctl.swarm.used_packages import on_host

_FOLDER = "packages"
#: Laid out as a devel space of catkin whose sources are in `_FOLDER`. Also one without a build is needed:
#: rosrun and roslaunch look into spaces before ROS_PACKAGE_PATH, so a workspace would hide the packages.
_SPACE = "built"


def files(swarm: Swarm, host: Host, packages: Iterable[DeliveredPackage]) -> Iterator[File]:
    """Yields every file of the packages that their programs read, and what their builds made."""
    for one in packages:
        origin = one.origin
        for path, (content, executable) in runtime_files(one):
            yield File(f"{_FOLDER}/{one.name}/{path}", content, 0o755 if executable else 0o644, origin)
        for path, (content, executable) in (_built(swarm, host, one) or {}).items():
            yield File(f"{_SPACE}/{path}", content, 0o755 if executable else 0o644, origin)


def space_marker(swarm: Swarm, host: Host) -> Iterator[File]:
    """Yields the file by which catkin knows the space of ``host``, if it has one."""
    if space(swarm, host):
        yield File(f"{_SPACE}/.catkin", f"{ROOT}/{swarm.name}/current/{_FOLDER}".encode())


def unbuilt(swarm: Swarm, host: Host) -> tuple[str, ...]:
    """Returns the packages of ``host`` that have to be built and are not."""
    return tuple(
        one.name for one in on_host(swarm, host) if one.built_by and _built(swarm, host, one) is None
    )


def space(swarm: Swarm, host: Host) -> str:
    """Returns the folder that catkin takes for the space of the packages of ``host``; empty without any."""
    return f"{ROOT}/{swarm.name}/current/{_SPACE}" if on_host(swarm, host) else ""


def platform(swarm: Swarm, host: Host) -> str:
    """Returns the platform that packages of ``host`` are built for; empty if none of them is built."""
    return host.platform if any(one.built_by for one in on_host(swarm, host)) else ""


def package_path(swarm: Swarm, host: Host) -> tuple[str, ...]:
    """Returns the folder in which ROS finds the packages of ``host``; none without a package."""
    return (f"{ROOT}/{swarm.name}/current/{_FOLDER}",) if on_host(swarm, host) else ()


def python_path(swarm: Swarm, host: Host) -> tuple[str, ...]:
    """Returns the folders in which Python finds the modules of the packages of ``host``."""
    return tuple(
        f"{ROOT}/{swarm.name}/current/{_FOLDER}/{one.name}/src"
        for one in on_host(swarm, host)
        if one.has_modules
    )


def _built(swarm: Swarm, host: Host, package: DeliveredPackage) -> Built | None:
    if not package.built_by or not host.platform:
        return None
    distro = swarm.distro_of(host.name)
    return swarm.builds.get(build_key(package.name, swarm.packages, distro, host.platform))
