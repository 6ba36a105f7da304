"""Keeps the agent compiled beside its archive: Python compiles the modules of a plain archive at every start.

The compiled archive begins with the CRC-32 of the rest, by which the loader finds one that did not reach the
disk whole. The sources are in it for a Python of another version: that of the host may be replaced.
"""

from __future__ import annotations

import io
import marshal
import os
import zipfile
import zlib
from _frozen_importlib_external import MAGIC_NUMBER
from contextlib import suppress

_UNCHECKED = (1).to_bytes(4, "little") + bytes(8)  # PEP 552: found by a hash, which is not compared


def write(archive: str, place: str) -> None:
    """Writes the modules of ``archive`` with their code for this Python to ``place``.

    What prevents that only costs time at the next start, so it is not reported.
    """
    with suppress(OSError):
        content = _compiled(archive, place)
        draft = f"{place}.{os.getpid()}"
        with open(draft, "wb") as file:
            file.write(b"%08x" % zlib.crc32(content) + content)
        os.replace(draft, place)


def _compiled(archive: str, place: str) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(archive) as sources, zipfile.ZipFile(stream, "w") as made:
        for name in sources.namelist():
            source = sources.read(name)
            code = compile(source, f"{place}/{name}", "exec", dont_inherit=True, optimize=2)
            made.writestr(zipfile.ZipInfo(name), source, zipfile.ZIP_DEFLATED)
            made.writestr(zipfile.ZipInfo(name + "c"), MAGIC_NUMBER + _UNCHECKED + marshal.dumps(code))
    return stream.getvalue()
