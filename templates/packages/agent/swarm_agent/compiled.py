"""Keeps the agent compiled beside its archive: Python compiles the modules of a plain archive at every start.

The compiled archive begins with the SHA-256 of the rest, which the loader compares.
"""

from __future__ import annotations

import hashlib
import io
import marshal
import os
import zipfile
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
            file.write(hashlib.sha256(content).hexdigest().encode() + content)
        os.replace(draft, place)


def _compiled(archive: str, place: str) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(archive) as sources, zipfile.ZipFile(stream, "w") as made:
        for name in sources.namelist():
            source = sources.read(name)
            code = compile(source, f"{place}/{name}", "exec", dont_inherit=True)
            made.writestr(zipfile.ZipInfo(name), source)
            made.writestr(zipfile.ZipInfo(name + "c"), MAGIC_NUMBER + _UNCHECKED + marshal.dumps(code))
    return stream.getvalue()
