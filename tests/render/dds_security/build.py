"""Participants of two DDS implementations, compiled once and cached by their source and library."""

from __future__ import annotations

import hashlib
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path

import pytest

from swarmctl.resources import cache_folder

HERE = Path(__file__).parent
FAST_DDS, CYCLONE_DDS = "fastdds", "cyclone"
IMPLEMENTATIONS = (FAST_DDS, CYCLONE_DDS)
_SOURCES = {FAST_DDS: "fastdds.cpp", CYCLONE_DDS: "cyclone.c"}
_COMPILERS = {FAST_DDS: "g++", CYCLONE_DDS: "gcc"}
_LIBRARIES = {FAST_DDS: "fastrtps", CYCLONE_DDS: "ddsc"}
_PACKAGES = {FAST_DDS: "libfastrtps-dev", CYCLONE_DDS: "cyclonedds-dev"}


@cache
def program(implementation: str) -> Path:
    """Return the path of the participant's program; skip the test if a package is missing that it needs."""
    source, compiler, library = (one[implementation] for one in (_SOURCES, _COMPILERS, _LIBRARIES))
    linked = next(Path("/usr/lib").glob(f"*/lib{library}.so"), None)
    if linked is None or shutil.which(compiler) is None:
        pytest.skip(f"apt install {_PACKAGES[implementation]} {compiler}")
    key = hashlib.sha256((HERE / source).read_bytes() + bytes(linked.resolve())).hexdigest()[:16]
    target = cache_folder() / f"dds-{implementation}-{key}"
    if not target.exists():
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=target.parent) as folder:
            made = Path(folder) / "made"
            options = [f'-DPLUGINS="{one.parent}"' for one in _plugins(linked)]
            argv = [compiler, "-O0", *options, "-o", made, HERE / source, f"-l{library}"]
            subprocess.run(argv, check=True)
            made.replace(target)
    return target


def _plugins(library: Path) -> list[Path]:
    """Return the plugin for authentication that Debian's Cyclone DDS has in a folder of its own."""
    return [*library.parent.glob("libddsc*/libdds_security_auth.so")]
