"""paramiko without `invoke`, which it would need to run ``Match exec`` of a configuration.

More than half of what paramiko imports comes with `invoke`: asyncio, unittest.
"""

from __future__ import annotations

import sys

_absent = sys.modules.setdefault("invoke", None) is None  # type: ignore[arg-type]  # to import it raises ImportError
try:
    import paramiko
    from paramiko.pkey import PublicBlob
finally:
    if _absent:
        del sys.modules["invoke"]

__all__ = ["PublicBlob", "paramiko"]
