"""Builds the operator's ROS packages in a catkin workspace of the swarm's folder, and packs the results.

The workspace stays: the next build compiles what changed since.
"""

from __future__ import annotations

import contextlib
import fcntl
import gzip
import io
import os
import pwd
import re
import shutil
import tarfile

from . import catkin, files
from .errors import FailedError, RefusedError
from .release_store import Home

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Callable, Iterator, Mapping, Sequence

FOLDER = "build"  # in the swarm's folder
PIECE = 1 << 20  # bytes of a result that one answer contains
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,100}")
_ELF = b"\x7fELF"
_LARGEST = 512 << 20  # bytes of one package's results
# Nobody runs the tests of a package here, and what they need (`test_depend`) is not installed.
_CMAKE = (
    *("-DCMAKE_BUILD_TYPE=Release", "-DCMAKE_BUILD_RPATH_USE_ORIGIN=ON"),
    "-DCATKIN_ENABLE_TESTING=OFF",
)


class Workspace:
    """The build folder of a swarm on this host."""

    def __init__(self, home: Home) -> None:
        self.path = f"{home.path}/{FOLDER}"
        self.final = home.through_current("packages")  # where the sources are on the robots

    @contextlib.contextmanager
    def held(self, owner: pwd.struct_passwd) -> Iterator[None]:
        """Makes the folder, and keeps other builds out of it. Raises ``RefusedError``."""
        os.makedirs(self.path, 0o755, exist_ok=True)
        os.chown(self.path, owner.pw_uid, owner.pw_gid)
        with open(f"{self.path}/.lock", "w", encoding="ascii") as lock:
            os.fchmod(lock.fileno(), 0o600)  # no other account can hold it
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError as error:
                raise RefusedError(
                    "another build of this swarm runs on the host", "wait for it, then run the same again"
                ) from error
            yield

    def write_sources(self, archive: bytes) -> list[str]:
        """Makes the sources those of the tar.gz; unchanged files keep their times. Returns the packages.

        Raises ``RefusedError``.
        """
        top, wanted = f"{self.path}/src", set()
        with tarfile.open(fileobj=io.BytesIO(archive), mode="r:gz") as packed:
            for member in packed:
                parts = member.name.split("/")
                if not member.isreg() or len(parts) < 2 or {"", ".", ".."} & set(parts):
                    raise RefusedError(f"{member.name!r} cannot be a source file")
                content = packed.extractfile(member)
                assert content is not None
                wanted.add(member.name)
                _write(f"{top}/{member.name}", content.read(), 0o755 if member.mode & 0o100 else 0o644)
        names = sorted({one.split("/")[0] for one in wanted})
        for path in list(files.walk(top)) if os.path.isdir(top) else ():
            if path not in wanted:
                os.unlink(f"{top}/{path}")
        for folder in ("src", "build_isolated", "devel_isolated"):
            for name in os.listdir(f"{self.path}/{folder}") if os.path.isdir(f"{self.path}/{folder}") else ():
                if name not in names and os.path.isdir(f"{self.path}/{folder}/{name}"):
                    shutil.rmtree(f"{self.path}/{folder}/{name}")
        return names

    def build(
        self,
        owner: pwd.struct_passwd,
        setups: Sequence[str],
        shown: Mapping[str, str],
        note: Callable[[str], None],
    ) -> None:
        """Compiles what changed. ``shown``: what errors call the folder of each package.

        Raises ``FailedError``.
        """
        basis = " ".join((*_CMAKE, *setups)).encode()
        if files.read(f"{self.path}/.basis") != basis:  # catkin keeps what it was built upon
            for folder in ("build_isolated", "devel_isolated"):
                shutil.rmtree(f"{self.path}/{folder}", ignore_errors=True)
            files.replace(f"{self.path}/.basis", basis)
        catkin.run(
            ["catkin_make_isolated", "-C", self.path, f"-j{catkin.jobs()}", "--cmake-args", *_CMAKE],
            "the build",
            owner=owner,
            setups=setups,
            log=f"{self.path}/log",
            note=note,
            shown={f"{self.path}/src/{name}/": f"{place}/" for name, place in shown.items()},
        )

    def pack(self, name: str) -> int:
        """Packs what a package's build made for running it; returns the size. Raises ``FailedError``."""
        stream, total = io.BytesIO(), 0
        with gzip.GzipFile(fileobj=stream, mode="wb", compresslevel=6, mtime=0) as packed, tarfile.open(
            fileobj=packed, mode="w", format=tarfile.PAX_FORMAT
        ) as archive:
            for path, place in self._results(name):
                content = files.read(place) or b""
                if not content.startswith(_ELF):
                    content = content.replace(f"{self.path}/src".encode(), self.final.encode())
                total += len(content)
                if total > _LARGEST:
                    raise FailedError(f"the results of {name} are larger than {_LARGEST >> 20} MiB")
                member = tarfile.TarInfo(path)
                member.size = len(content)
                member.mode = 0o755 if os.stat(place).st_mode & 0o100 else 0o644
                archive.addfile(member, io.BytesIO(content))
        os.makedirs(f"{self.path}/out", exist_ok=True)
        files.replace(self._result(name), stream.getvalue())
        return len(stream.getvalue())

    def piece(self, name: str, offset: int) -> bytes:
        """Returns up to ``PIECE`` bytes of a packed result. Raises ``RefusedError``."""
        if not _NAME.fullmatch(name) or not os.path.isfile(self._result(name)):
            raise RefusedError(f"there is no build of {name!r}", "run the same command again")
        with open(self._result(name), "rb") as file:
            file.seek(offset)
            return file.read(PIECE)

    def _result(self, name: str) -> str:
        return f"{self.path}/out/{name}.tar.gz"

    def _results(self, name: str) -> Iterator[tuple[str, str]]:
        """Executables, libraries and Python modules: paths in the space, and where they are."""
        top = f"{self.path}/devel_isolated/{name}"
        inside = [f"lib/{path}" for path in files.walk(f"{top}/lib")] if os.path.isdir(f"{top}/lib") else []
        for path in sorted(inside):
            place = os.path.realpath(f"{top}/{path}")
            needless = path.startswith("lib/pkgconfig/") or path.endswith((".a", ".pyc"))
            if not needless and os.path.isfile(place) and place.startswith(f"{self.path}/"):
                yield path, place
        # A library that its CMakeLists.txt adds before catkin_package() stays in the folder where cmake ran.
        top = f"{self.path}/build_isolated/{name}"
        for file in sorted(os.listdir(top)) if os.path.isdir(top) else ():
            place = os.path.realpath(f"{top}/{file}")
            if re.search(r"\.so(\.|$)", file) and f"lib/{file}" not in inside and place.startswith(f"{top}/"):
                yield f"lib/{file}", place


def _write(path: str, content: bytes, mode: int) -> None:
    if files.read(path) != content:
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "wb") as file:
            file.write(content)
    os.chmod(path, mode)
