"""The first message of a handshake of WireGuard, of any time. Source: Donenfeld, "WireGuard", 5.4.2."""

from __future__ import annotations

import base64
import hashlib
import hmac
import struct

from cryptography.hazmat.primitives.asymmetric.x25519 import X25519PrivateKey, X25519PublicKey
from cryptography.hazmat.primitives.ciphers.aead import ChaCha20Poly1305

CONSTRUCTION = b"Noise_IKpsk2_25519_ChaChaPoly_BLAKE2s"
IDENTIFIER = b"WireGuard v1 zx2c4 Jason@zx2c4.com"
TAI_EPOCH = 0x400000000000000A
NONCE = bytes(12)


def initiation(private: str, peer: str, seconds: int) -> bytes:
    """Returns that of the host with the key ``private`` for ``peer``; ``seconds`` since 1970 is its time."""
    own, other = X25519PrivateKey.from_private_bytes(base64.b64decode(private)), base64.b64decode(peer)
    to = X25519PublicKey.from_public_bytes(other)
    ephemeral = X25519PrivateKey.generate()
    public = ephemeral.public_key().public_bytes_raw()
    chain = _hash(CONSTRUCTION)
    state = _hash(_hash(_hash(chain + IDENTIFIER) + other) + public)
    (chain,) = _derived(chain, public, 1)
    chain, key = _derived(chain, ephemeral.exchange(to), 2)
    static = ChaCha20Poly1305(key).encrypt(NONCE, own.public_key().public_bytes_raw(), state)
    state = _hash(state + static)
    _, key = _derived(chain, own.exchange(to), 2)
    stamp = ChaCha20Poly1305(key).encrypt(NONCE, struct.pack(">QI", TAI_EPOCH + seconds, 0), state)
    message = struct.pack("<II", 1, 1) + public + static + stamp
    mac = hashlib.blake2s(message, key=_hash(b"mac1----" + other), digest_size=16).digest()
    return message + mac + bytes(16)


def _hash(text: bytes) -> bytes:
    return hashlib.blake2s(text).digest()


def _derived(key: bytes, text: bytes, number: int) -> list[bytes]:
    secret, made = hmac.digest(key, text, "blake2s"), [b""]
    for count in range(1, number + 1):
        made.append(hmac.digest(secret, made[-1] + bytes([count]), "blake2s"))
    return made[1:]
