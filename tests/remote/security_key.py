"""The work of the security key in ``security_key.c``: an Ed25519 key that signs once somebody touches it.

``SWARM_TOUCHED`` is a file: while it does not exist, nobody has touched the key (PROTOCOL.u2f of OpenSSH).
"""

from __future__ import annotations

import os
import sys
import time
from hashlib import sha256
from pathlib import Path

from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

KEY = Ed25519PrivateKey.from_private_bytes(bytes(range(32)))
PRESENT, COUNTER = b"\x01", (1).to_bytes(4, "big")

if __name__ == "__main__":
    if sys.argv[1] == "enroll":
        print(KEY.public_key().public_bytes_raw().hex())
    else:
        application, data = sys.argv[2].encode(), bytes.fromhex(sys.argv[3])
        while not Path(os.environ["SWARM_TOUCHED"]).exists():
            time.sleep(0.02)
        print(KEY.sign(sha256(application).digest() + PRESENT + COUNTER + sha256(data).digest()).hex())
