"""A keystore of SROS 2: what it lacks, and the authority that makes keys and signs.

Source: OMG DDS Security 1.1, 9.3.1 (elliptic curve prime256v1, SHA-256) and 9.4.1 (S/MIME).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timezone
from email import message_from_bytes, policy
from secrets import token_hex

from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import (
    Encoding,
    NoEncryption,
    PrivateFormat,
    PublicFormat,
    load_pem_private_key,
    pkcs7,
)

from swarmctl.render.bundle import Enclave
from swarmctl.spec import keystore

_NAME = "sros2CA"
#: A host without a battery clock starts in the past, and a swarm is not to stop on a day: another authority
#: replaces a key, not a date.
_FROM, _UNTIL = datetime(2000, 1, 1, tzinfo=timezone.utc), datetime(2099, 12, 31, tzinfo=timezone.utc)


@dataclass(frozen=True)
class Authority:
    """An authority: its private key, and its certificate."""

    key: ec.EllipticCurvePrivateKey
    certificate: x509.Certificate

    @classmethod
    def of(cls, key: str, certificate: bytes | None) -> Authority:
        """Returns the authority with a private key, and with a new certificate if it has none. Both are PEM.

        Raises ``ValueError`` if one of them cannot be read, or if they do not belong together.
        """
        private = private_key(key)
        if certificate is None:
            name = _name(f"{_NAME}-{token_hex(4)}")  # a node that trusts two of one name trusts one
            return cls(private, _certificate(name, private.public_key(), name, private, is_authority=True))
        try:
            found = x509.load_pem_x509_certificate(certificate)
        except ValueError:
            raise ValueError("the certificate is none as PEM") from None
        if public_bytes(found.public_key()) != public_bytes(private.public_key()):
            raise ValueError("the certificate is that of another key")
        return cls(private, found)

    def certificate_of(self, subject: str, key: ec.EllipticCurvePrivateKey) -> bytes:
        """Returns the certificate of a private key under a common name, as PEM."""
        made = _certificate(_name(subject), key.public_key(), self.certificate.subject, self.key)
        return pem(made)

    def has_issued(self, certificate: bytes, subject: str, key: ec.EllipticCurvePrivateKey | None) -> bool:
        """True if ``certificate``, as PEM, is of this authority for ``subject``, and for ``key`` if given."""
        try:
            found = x509.load_pem_x509_certificate(certificate)
            found.verify_directly_issued_by(self.certificate)
        except Exception:  # noqa: BLE001  whatever is wrong with it, a new one replaces it
            return False
        fits = key is None or public_bytes(found.public_key()) == public_bytes(key.public_key())
        return fits and found.subject == _name(subject)

    def signed(self, content: bytes) -> bytes:
        """Returns a text with its signature, as S/MIME (RFC 8551)."""
        builder = pkcs7.PKCS7SignatureBuilder().set_data(content)
        builder = builder.add_signer(self.certificate, self.key, hashes.SHA256())
        return builder.sign(Encoding.SMIME, [pkcs7.PKCS7Options.DetachedSignature, pkcs7.PKCS7Options.Text])

    def has_signed(self, signed: bytes) -> bool:
        """True if ``signed``, as S/MIME, has a signature that names this authority; it is not verified."""
        try:
            *_, signature = message_from_bytes(signed, policy=policy.default).walk()
            named = pkcs7.load_der_pkcs7_certificates(signature.get_content())
        except Exception:  # noqa: BLE001  whatever is wrong with it, a new one replaces it
            return False
        return self.certificate in named


def new_key() -> str:
    """Returns a new private key, as PEM."""
    key = ec.generate_private_key(ec.SECP256R1())
    return key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption()).decode()


def private_key(text: str) -> ec.EllipticCurvePrivateKey:
    """Returns a private key. Raises ``ValueError`` for a text that is none of an elliptic curve, as PEM."""
    try:
        key = load_pem_private_key(text.encode(), None)
    except (ValueError, TypeError) as error:
        raise ValueError(f"it is no private key as PEM ({type(error).__name__})") from None
    if not isinstance(key, ec.EllipticCurvePrivateKey):
        raise ValueError("it is no key of an elliptic curve")
    return key


def pem(certificate: x509.Certificate) -> bytes:
    """Returns a certificate as PEM."""
    return certificate.public_bytes(Encoding.PEM)


def public_bytes(key: object) -> bytes:
    """Returns a public key as bytes that are equal for equal keys."""
    return key.public_bytes(Encoding.DER, PublicFormat.SubjectPublicKeyInfo)  # type: ignore[attr-defined,no-any-return]


def _name(text: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, text)])


def _certificate(
    subject: x509.Name,
    key: ec.EllipticCurvePublicKey,
    issuer: x509.Name,
    signer: ec.EllipticCurvePrivateKey,
    *,
    is_authority: bool = False,
) -> x509.Certificate:
    builder = x509.CertificateBuilder(issuer, subject, key, x509.random_serial_number(), _FROM, _UNTIL)
    limits = x509.BasicConstraints(ca=is_authority, path_length=1 if is_authority else None)
    return builder.add_extension(limits, critical=True).sign(signer, hashes.SHA256())


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
