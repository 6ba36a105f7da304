"""What a keystore of SROS 2 lacks: nothing twice, and nobody's key anew; `openssl` judges what is made."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path

import pytest
from cryptography.hazmat.primitives.asymmetric import rsa
from cryptography.hazmat.primitives.serialization import (
    BestAvailableEncryption,
    Encoding,
    NoEncryption,
    PrivateFormat,
)

from swarmctl.deploy.sros2_keystore import KeystoreError, Missing, missing, new_key, private_key, secrets_of
from swarmctl.render.bundle import Enclave
from swarmctl.spec import keystore
from tests.sros2 import JOINS, bundles_in, enclaves_of, write_spec

NEEDS_OPENSSL = pytest.mark.skipif(shutil.which("openssl") is None, reason="needs openssl")


def enclave(name: str, permissions: str = "<dds>\n</dds>\n") -> Enclave:
    folder, key = keystore.folder("lab", name), keystore.secret(name)
    return Enclave(name, f"/{name}", folder, key, b"<rules/>\n", permissions.encode(), complete=False)


K3, HUB = enclave("robots/k3"), enclave("hosts/hub")
CERTIFICATE, PERMISSIONS = f"{K3.folder}/{keystore.CERTIFICATE}", f"{K3.folder}/{keystore.PERMISSIONS}"


@dataclass
class Kept:
    """A keystore, and the private keys that an operator has."""

    files: dict[str, bytes] = field(default_factory=dict)
    secrets: dict[str, str] = field(default_factory=dict)

    def complete(self, *enclaves: Enclave) -> Missing:
        """Adds what is missing; returns it."""
        found = missing(enclaves, self.files, self.secrets)
        self.files |= found.files
        self.secrets |= found.secrets
        return found


@pytest.fixture
def kept() -> Kept:
    made = Kept()
    made.complete(K3, HUB)
    return made


def without(names: Iterable[str], of: Kept) -> Kept:
    files, secrets = (
        {name: value for name, value in values.items() if name not in {*names}}
        for values in (of.files, of.secrets)
    )
    return Kept(files, secrets)  # type: ignore[arg-type]


def test_a_new_keystore_has_all_and_then_nothing_is_missing(kept: Kept) -> None:
    files = {f"{one.folder}/{name}" for one in (K3, HUB) for name in ("cert.pem", "permissions.p7s")}
    assert kept.files.keys() == {*files, keystore.CA, keystore.GOVERNANCE}
    assert (
        {*secrets_of([K3, HUB])} == kept.secrets.keys() == {"sros2-ca", "sros2-robots-k3", "sros2-hosts-hub"}
    )
    assert len({*kept.secrets.values()}) == 3
    assert kept.complete(K3, HUB) == Missing({}, {})


def test_a_robot_that_joins_changes_permissions_of_others_only(tmp_path: Path) -> None:
    write_spec(tmp_path)
    before, kept = enclaves_of(bundles_in(tmp_path)), Kept()
    kept.complete(*before.values())
    write_spec(tmp_path, JOINS)
    after = enclaves_of(bundles_in(tmp_path))
    assert after.keys() - before.keys() == {"robots/second"}
    found, joined = kept.complete(*after.values()), after["robots/second"]
    assert found.secrets.keys() == {joined.key}
    assert found.files.keys() == {
        f"{joined.folder}/{keystore.CERTIFICATE}",
        *(f"{one.folder}/{keystore.PERMISSIONS}" for one in after.values()),
    }


#: What is not here, and what is made then: of the keystore, and of the secrets.
LOST: dict[str, tuple[set[str], set[str], set[str]]] = {
    "a certificate": ({CERTIFICATE}, {CERTIFICATE}, set()),
    "permissions": ({PERMISSIONS}, {PERMISSIONS}, set()),
    "the governance": ({keystore.GOVERNANCE}, {keystore.GOVERNANCE}, set()),
    "the key of a colleague, with its certificate": ({K3.key}, set(), set()),
    "a key and its certificate": ({K3.key, CERTIFICATE}, {CERTIFICATE}, {K3.key}),
}


@pytest.mark.parametrize("what", LOST)
def test_only_what_is_lost_is_made_anew(what: str, kept: Kept) -> None:
    lost, files, secrets = LOST[what]
    found = without(lost, kept).complete(K3, HUB)
    assert (found.files.keys(), found.secrets.keys()) == (files, secrets)


@pytest.mark.parametrize("lost", ["the keystore", "the certificate of the authority"])
def test_another_authority_signs_all_anew_and_keeps_the_keys(lost: str, kept: Kept) -> None:
    gone = {keystore.CA} if lost.startswith("the certificate") else {*kept.files}
    found = without(gone, kept).complete(K3, HUB)
    assert found.secrets == {}
    assert found.files.keys() == kept.files.keys()
    assert all(found.files[path] != kept.files[path] for path in kept.files)


def foreign(name: str = K3.name) -> Kept:
    made = Kept()
    made.complete(enclave(name), HUB)
    return made


def test_a_certificate_that_does_not_fit_is_replaced(kept: Kept) -> None:
    """One of another authority, of another subject, of another key, and none at all."""
    subject, key = replace(K3, subject="/robots/k4"), {K3.key: new_key()}
    unfit = {
        "of another authority": foreign().files[CERTIFICATE],
        "of another subject": missing([subject], kept.files, kept.secrets).files[CERTIFICATE],
        "of another key": missing([K3], kept.files, kept.secrets | key).files[CERTIFICATE],
        "damaged": kept.files[CERTIFICATE][:200],
    }
    for what, content in unfit.items():
        now = Kept({**kept.files, CERTIFICATE: content}, dict(kept.secrets))
        found = now.complete(K3, HUB)
        assert (found.files.keys(), found.secrets) == ({CERTIFICATE}, {}), what
        assert now.complete(K3, HUB) == Missing({}, {})


def test_what_is_not_signed_by_this_authority_is_signed_anew(kept: Kept) -> None:
    """Two colleagues have merged their keystores; a file was cut; a text was changed."""
    text = kept.files[PERMISSIONS]
    unfit = {
        "by another authority": foreign().files[PERMISSIONS],
        "cut": text[: text.index(b"</dds>") + 50],
        "not at all": K3.permissions,
        "another text": text.replace(b"<dds>", b"<ddt>"),
    }
    for what, content in unfit.items():
        found = missing([K3, HUB], {**kept.files, PERMISSIONS: content}, kept.secrets)
        assert (found.files.keys(), found.secrets) == ({PERMISSIONS}, {}), what


def rsa_key() -> str:
    key = rsa.generate_private_key(65537, 2048)
    return key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption()).decode()


def locked_key() -> str:
    form = BestAvailableEncryption(b"word")
    return private_key(new_key()).private_bytes(Encoding.PEM, PrivateFormat.PKCS8, form).decode()


NO_PEM, LOCKED = "it is no private key as PEM (ValueError)", "it is no private key as PEM (TypeError)"
NO_CURVE, ANOTHER = "it is no key of an elliptic curve", "the certificate is that of another key"


@pytest.mark.parametrize(
    ("make", "why"),
    [(new_key, ANOTHER), (lambda: "no key", NO_PEM), (rsa_key, NO_CURVE), (locked_key, LOCKED)],
    ids=["another", "damaged", "rsa", "locked"],
)
def test_a_key_that_cannot_sign_is_an_error(make: object, why: str, kept: Kept) -> None:
    key = make()  # type: ignore[operator]
    with pytest.raises(KeystoreError) as caught:
        missing([K3], kept.files, {**kept.secrets, keystore.CA_SECRET: key})
    assert str(caught.value) == f"`secrets/sros2-ca` and keystore/public/ca.cert.pem cannot sign: {why}"
    assert caught.value.fix == "bring back what was there; or remove both, for new ones"
    if why != ANOTHER:
        with pytest.raises(KeystoreError) as caught:
            missing([K3], kept.files, {**kept.secrets, K3.key: key})
        assert str(caught.value) == f"the secret sros2-robots-k3 is no key: {why}"
        assert caught.value.fix == "remove `secrets/sros2-robots-k3`, for a new one"


def test_a_damaged_certificate_of_the_authority_is_an_error(kept: Kept) -> None:
    with pytest.raises(KeystoreError, match=r"cannot sign: the certificate is none as PEM$"):
        missing([K3], {**kept.files, keystore.CA: kept.files[keystore.CA][:99]}, kept.secrets)


def test_who_does_not_have_the_key_of_the_authority_signs_nothing(kept: Kept) -> None:
    with pytest.raises(KeystoreError) as caught:
        missing([K3], kept.files, without({keystore.CA_SECRET}, kept).secrets)
    assert str(caught.value) == "the private key of keystore/public/ca.cert.pem is not here"
    assert caught.value.fix == (
        "copy `secrets/sros2-ca` from who has made it; or remove `keystore`, "
        "for a new one and new certificates"
    )
    emptied = Kept({}, without({keystore.CA_SECRET}, kept).secrets)
    assert emptied.complete(K3, HUB).secrets.keys() == {keystore.CA_SECRET}


def openssl(folder: Path, *words: str) -> str:
    ran = subprocess.run(["openssl", *words], cwd=folder, capture_output=True, text=True, check=True)
    return ran.stdout


def written(folder: Path, kept: Kept) -> Path:
    for path, content in kept.files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_bytes(content)
    return folder


@NEEDS_OPENSSL
def test_openssl_finds_certificates_and_signatures_valid(tmp_path: Path) -> None:
    longest = enclave(f"programs/{'a' * 31}", "<dds>\n  <grant/>\n</dds>\n")  # of the kinds and of names
    kept = Kept()
    kept.complete(longest, HUB)
    folder, own = written(tmp_path, kept), f"{longest.folder}/{keystore.CERTIFICATE}"
    assert openssl(folder, "verify", "-CAfile", keystore.CA, own) == f"{own}: OK\n"
    subject = openssl(folder, "x509", "-in", own, "-noout", "-subject", "-nameopt", "sep_multiline")
    assert subject.split("CN=")[1].strip() == longest.subject
    assert len(longest.subject) <= 64  # RFC 5280, A.1: ub-common-name
    dates = openssl(folder, "x509", "-in", own, "-noout", "-dates", "-dateopt", "iso_8601")
    assert dates == "notBefore=2000-01-01 00:00:00Z\nnotAfter=2099-12-31 00:00:00Z\n"
    public = openssl(folder, "x509", "-in", own, "-noout", "-pubkey")
    (tmp_path / "key.pem").write_text(kept.secrets[longest.key])
    assert openssl(folder, "pkey", "-in", "key.pem", "-pubout") == public
    assert "prime256v1" in openssl(folder, "pkey", "-in", "key.pem", "-noout", "-text")
    for path, text in {
        f"{longest.folder}/{keystore.PERMISSIONS}": longest.permissions,
        keystore.GOVERNANCE: longest.governance,
    }.items():
        content = openssl(folder, "smime", "-verify", "-text", "-in", path, "-CAfile", keystore.CA)
        assert content.replace("\r\n", "\n").encode() == text
