"""What lets a lab host run containers: the packages of the engine, its settings, and what nspawn allows."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from swarmctl.lab.paths import HostPaths

#: The Debian packages of each engine that runs in a lab host.
PACKAGES: Mapping[str, tuple[str, ...]] = {"podman": ("podman", "runc")}
#: Files of an image with podman. systemd-nspawn forbids keyrings; crun needs CAP_SYS_RESOURCE, which root in
#: a container may lack; the limit on processes needs a machine without controllers of cgroup v1.
FILES: Mapping[str, str] = {
    "etc/containers/containers.conf.d/lab.conf": "[containers]\nkeyring = false\npids_limit = 0\n"
    '[engine]\nruntime = "runc"\n'
}
STORAGE = "/var/lib/containers"  # of the engine of root


def packages_of(engines: Iterable[str]) -> tuple[str, ...]:
    """Returns the Debian packages of ``engines``; none of those that do not run in a lab."""
    return tuple(name for engine in engines for name in PACKAGES.get(engine, ()))


def settings_of(packages: Iterable[str]) -> Mapping[str, str]:
    """Returns the files of an image with these Debian packages that are the engine's settings."""
    return FILES if set(PACKAGES["podman"]) <= set(packages) else {}


def nspawn_options(files: HostPaths, engines: Iterable[str]) -> tuple[str, ...]:
    """Returns the options for a host: a folder for images, if a program of it is a container.

    The folder is not on the host's overlay file system, since no overlay lies on another one.
    """
    return (f"--bind={files.containers}:{STORAGE}",) if packages_of(engines) else ()
