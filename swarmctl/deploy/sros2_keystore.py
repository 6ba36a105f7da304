"""What a keystore of SROS 2 lacks: new private keys, certificates and signed files. Opens no file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from cryptography.hazmat.primitives.asymmetric import ec

from swarmctl.deploy.sros2_authority import Authority, new_key, pem, private_key
from swarmctl.render.bundle import Enclave
from swarmctl.spec import keystore


class KeystoreError(Exception):
    """The keystore cannot be completed; ``fix`` is the advice."""

    def __init__(self, message: str, fix: str) -> None:
        super().__init__(message)
        self.fix = fix


@dataclass(frozen=True)
class Missing:
    """What a keystore lacks: ``files`` by path from the spec's folder, ``secrets`` by name."""

    files: Mapping[str, bytes]
    secrets: Mapping[str, str]


def secrets_of(enclaves: Iterable[Enclave]) -> list[str]:
    """Returns the secrets that are private keys of a keystore."""
    return [keystore.CA_SECRET, *(one.key for one in enclaves)]


def missing(enclaves: Sequence[Enclave], kept: Mapping[str, bytes], secrets: Mapping[str, str]) -> Missing:
    """Returns what the keystore with the files ``kept`` lacks for ``enclaves``.

    ``secrets``: private keys that the operator has, by name. Raises ``KeystoreError``.
    """
    files, made = dict[str, bytes](), dict[str, str]()
    authority = _authority(kept, secrets, made)
    if keystore.CA not in kept:
        files[keystore.CA] = pem(authority.certificate)

    def sign(path: str, text: bytes) -> None:
        old = kept.get(path, b"")
        if path not in files and not (keystore.in_signed(text) in old and authority.has_signed(old)):
            files[path] = authority.signed(text)

    for enclave in enclaves:
        certificate, own = f"{enclave.folder}/{keystore.CERTIFICATE}", _key_of(enclave, secrets)
        if not authority.has_issued(kept.get(certificate, b""), enclave.subject, own):
            if own is None:
                own = private_key(made.setdefault(enclave.key, new_key()))
            files[certificate] = authority.certificate_of(enclave.subject, own)
        sign(keystore.GOVERNANCE, enclave.governance)
        sign(f"{enclave.folder}/{keystore.PERMISSIONS}", enclave.permissions)
    return Missing(files, made)


def _authority(kept: Mapping[str, bytes], secrets: Mapping[str, str], made: dict[str, str]) -> Authority:
    """The authority of a keystore; a new one without any."""
    if keystore.CA in kept and keystore.CA_SECRET not in secrets:
        raise KeystoreError(
            f"the private key of {keystore.CA} is not here",
            f"copy `secrets/{keystore.CA_SECRET}` from who has made it; or remove `{keystore.FOLDER}`, "
            "for a new one and new certificates",
        )
    key = secrets.get(keystore.CA_SECRET) or made.setdefault(keystore.CA_SECRET, new_key())
    try:
        return Authority.of(key, kept.get(keystore.CA))
    except ValueError as error:
        raise KeystoreError(
            f"`secrets/{keystore.CA_SECRET}` and {keystore.CA} cannot sign: {error}",
            "bring back what was there; or remove both, for new ones",
        ) from None


def _key_of(enclave: Enclave, secrets: Mapping[str, str]) -> ec.EllipticCurvePrivateKey | None:
    try:
        return private_key(secrets[enclave.key]) if enclave.key in secrets else None
    except ValueError as error:
        raise KeystoreError(
            f"the secret {enclave.key} is no key: {error}", f"remove `secrets/{enclave.key}`, for a new one"
        ) from None
