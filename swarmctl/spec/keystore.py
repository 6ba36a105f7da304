"""Where the files of SROS 2 lie beside a spec: the layout of a keystore of ROS 2, without its private keys.

Private keys are secrets of swarmctl (`secrets/` beside the spec); all else can stand in a repository.
Source: the design article "ROS 2 Security Enclaves" (design.ros2.org).
"""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.spec.model import Spec

FOLDER = "keystore"
CA = f"{FOLDER}/public/ca.cert.pem"
GOVERNANCE = f"{FOLDER}/enclaves/governance.p7s"
CERTIFICATE, PERMISSIONS = "cert.pem", "permissions.p7s"
CA_SECRET = "sros2-ca"  # the authority's private key, which goes to no host


def paths(spec: Spec) -> Iterator[str]:
    """Yields the files that the hosts of ``spec`` may need, from the folder of the spec."""
    if not spec.ros.sros2:
        return
    yield from (CA, GOVERNANCE)
    kinds = {"hosts": [*spec.hosts], "robots": [*spec.robots], "gates": [*spec.robots]}
    for kind, names in {**kinds, "programs": [*spec.programs]}.items():
        for name in names:
            for file in (CERTIFICATE, PERMISSIONS):
                yield f"{folder(spec.name, f'{kind}/{name}')}/{file}"


def folder(swarm: str, enclave: str) -> str:
    """Returns the folder of an enclave, from the folder of the spec."""
    return f"{FOLDER}/enclaves/{swarm}/{enclave}"


def secret(enclave: str) -> str:
    """Returns the name of the secret that is the private key of an enclave."""
    return f"sros2-{enclave.replace('/', '-')}"


def in_signed(text: bytes) -> bytes:
    """Returns a text as a signed file contains it (RFC 8551, 3.1.1)."""
    return text.replace(b"\n", b"\r\n")
