"""Reads the packages that a spec delivers: all files of their folders but links and hidden ones."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

from swarmctl.ros_packages.builds import delivered_package
from swarmctl.ros_packages.package import MANIFEST, DeliveredPackage, package_of
from swarmctl.spec.install_model import PackageSource
from swarmctl.spec.package_search import BUILT, WorkspaceFolderError, package_folders
from swarmctl.yamltext.project_files import ProjectFiles

MAX_FILES = 2000  # of one package
MAX_BYTES = 32 << 20  # of one package: a release goes to hosts over their wlan
MAX_LEVELS = 32  # of folders within a package
MAX_ALL_BYTES = 256 << 20  # of all packages of one workspace
_ANY_SUFFIX = ("",)
_HIDES = "CATKIN_IGNORE"  # beside a package.xml: the package is named by the spec, so it is delivered
_LEAVE_OUT = "; an empty file CATKIN_IGNORE beside its package.xml leaves a package out"


class _RefusalError(Exception):
    """Why a folder is no package that can be delivered."""


def read_delivered(
    folder: Path, sources: Mapping[str, PackageSource], files: ProjectFiles
) -> tuple[dict[str, DeliveredPackage], dict[str, str]]:
    """Returns packages by name, and by entry why others cannot be delivered.

    ``sources``: by entry where packages are, from the ``folder`` of the spec. An entry of its own counts
    more than a workspace that has the package as well.
    """
    found: dict[str, DeliveredPackage] = {}
    refused: dict[str, str] = {}
    for name, source in sorted(sources.items(), key=lambda one: one[1].all):
        if reason := _add(found, _from(source, name, folder, files), frozenset(source.skip_keys)):
            refused[name] = reason
    return found, refused


def _add(
    found: dict[str, DeliveredPackage], more: Iterator[DeliveredPackage], skip_keys: frozenset[str]
) -> str:
    """Adds the packages of an entry to ``found``; returns why that cannot be, or nothing."""
    try:
        for one in more:
            known = found.get(one.name)
            if known is not None and known.entry:
                twice = f"has the package {one.name} at {one.folder}, which {known.folder} is as well"
                return f"{twice}{_LEAVE_OUT}"
            if known is None:
                found[one.name] = replace(one, skip_keys=skip_keys)
    except _RefusalError as error:
        return str(error)
    return ""


def _from(source: PackageSource, name: str, folder: Path, files: ProjectFiles) -> Iterator[DeliveredPackage]:
    """Yields the packages of an entry. Raises ``_RefusalError``."""
    place = folder / source.folder
    if reason := files.refusal(place, _ANY_SUFFIX):
        raise _RefusalError(reason)
    if not place.is_dir():
        raise _RefusalError("does not exist" if not place.exists() else "is not a folder")
    try:
        if source.all:
            yield from _all_of(place, name, source.folder, files)
        else:
            yield _read(name, place, source.folder, files)
    except OSError as error:
        raise _RefusalError(f"cannot be read: {error.strerror or error}") from error


def _all_of(place: Path, entry: str, shown: str, files: ProjectFiles) -> Iterator[DeliveredPackage]:
    """Yields the packages of a workspace. Raises ``_RefusalError`` and ``OSError``."""
    size, any_of_it = 0, False
    try:
        for path in package_folders(place, files):
            inside = path.relative_to(place).as_posix()
            manifest = package_of("", {}, {MANIFEST: files.read(path / MANIFEST)})
            if manifest is None:
                raise _RefusalError(f"has {inside}, whose {MANIFEST} names no package{_LEAVE_OUT}")
            try:
                one = _read(manifest.name, path, shown if inside == "." else f"{shown}/{inside}", files)
            except _RefusalError as error:
                raise _RefusalError(f"has {inside}, which {error}{_LEAVE_OUT}") from error
            size += sum(len(content) for content, _ in one.files.values())
            if size > MAX_ALL_BYTES:
                raise _RefusalError(f"has packages of more than {MAX_ALL_BYTES >> 20} MiB")
            any_of_it = True
            yield replace(one, entry=entry)
    except WorkspaceFolderError as error:
        raise _RefusalError(str(error)) from error
    if not any_of_it:
        raise _RefusalError(f"has no {MANIFEST}, nor has a folder below it")


def _read(name: str, place: Path, shown: str, files: ProjectFiles) -> DeliveredPackage:
    """Returns the package in a folder. Raises ``_RefusalError`` and ``OSError``."""
    found = delivered_package(name, shown, dict(_contents(place, files)))
    if isinstance(found, str):
        raise _RefusalError(found)
    return found


def _contents(place: Path, files: ProjectFiles) -> Iterator[tuple[str, tuple[bytes, bool]]]:
    count, size = 0, 0
    for path in _files_below(place, files):
        count, size = count + 1, size + path.stat().st_size
        if count > MAX_FILES:
            raise _RefusalError(f"has more than {MAX_FILES} files, the limit for a package")
        if size > MAX_BYTES:
            raise _RefusalError(f"is larger than {MAX_BYTES >> 20} MiB, the limit for a package")
        may = bool(path.stat().st_mode & stat.S_IXUSR)
        yield path.relative_to(place).as_posix(), (files.read(path), may)


def _files_below(folder: Path, files: ProjectFiles, level: int = 0) -> Iterator[Path]:
    if level > MAX_LEVELS:
        raise _RefusalError(f"has folders within folders beyond {MAX_LEVELS} levels, the limit for a package")
    for name in files.names(folder):
        path = folder / name
        if path.is_symlink() or name in (*BUILT, _HIDES) or name.endswith(".pyc"):
            continue
        if path.is_dir():
            yield from _files_below(path, files, level + 1)
        elif os.access(path, os.R_OK) and path.is_file():
            yield path
