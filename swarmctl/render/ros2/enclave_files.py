"""The files of SROS 2 in a release, and the unit that gives people the keys of their enclaves. Pure."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from swarmctl.render import shipped_files
from swarmctl.render.bundle import Enclave, File, Part, SecretForm, Unit
from swarmctl.render.quoting import render
from swarmctl.render.ros2.enclaves import (
    Grant,
    governance,
    of_host,
    of_program,
    on_host,
    permissions,
)
from swarmctl.render.service_values import service_values
from swarmctl.spec import keystore
from swarmctl.swarm import names
from swarmctl.swarm.resolved import Host, Swarm

PUT_ENCLAVE = "bin/put-enclave"
_FOLDER = "enclaves"
_IDENTITY, _PERMISSIONS, _GOVERNANCE = (
    f"{_FOLDER}/{name}"
    for name in ("identity_ca.cert.pem", "permissions_ca.cert.pem", "governance.p7s")
)  # fmt: skip


def part(swarm: Swarm, host: Host) -> Part:
    """Returns what the enclaves of ``host`` consist of, and the names of their keys."""
    if not swarm.sros2:
        return Part()
    found, forms = list(on_host(swarm, host)), dict[str, SecretForm]()
    for one in found:
        forms[keystore.secret(one.name)] = "text"
    name = names.unit(swarm.name, names.ENCLAVES)
    unit, people = File(f"units/{name}", _unit(swarm, host), origin="ros.sros2"), list(of_people(swarm, host))
    read = dict.fromkeys(
        path for one in people for path in (*needs(swarm, one), _path(one, keystore.PERMISSIONS))
    )
    secrets = tuple(secret for one in people for secret in secrets_of(swarm, one))
    return Part(
        files=(*_files(swarm, found), unit),
        units=(Unit(name, (unit.path, *read), secrets=secrets),),
        secrets=tuple(forms),
        secret_forms=forms,
        enclaves=tuple(_enclave(swarm, one) for one in found),
    )


def of_people(swarm: Swarm, host: Host) -> Iterator[Grant]:
    """Yields the enclaves that a person at a terminal of ``host`` uses."""
    yield of_host(swarm, host)
    for program in swarm.programs_on(host.name):
        if program.is_interactive:
            yield of_program(swarm, program)


def needs(swarm: Swarm, grant: Grant) -> tuple[str, ...]:
    """Returns the files whose change restarts what runs in an enclave.

    Its permissions are not among them: as to others' topics they change with each robot that joins, and the
    next start reads them. What it may publish itself stands in its unit. Only the unit for people, with
    whose restart nothing ends, restarts for permissions as well.
    """
    certificate = _path(grant, keystore.CERTIFICATE)
    return (_IDENTITY, _GOVERNANCE, certificate, PUT_ENCLAVE) if swarm.sros2 else ()


def secrets_of(swarm: Swarm, grant: Grant) -> tuple[str, ...]:
    """Returns the secrets that what runs in an enclave reads: its key."""
    return (keystore.secret(grant.name),) if swarm.sros2 else ()


def unit_values(swarm: Swarm, grant: Grant) -> dict[str, Any]:
    """Returns the template values of a unit that runs in an enclave."""
    key = f"/etc/swarm/{swarm.name}/secrets/{keystore.secret(grant.name)}"
    below = tuple(f"{space}/" for space in grant.spaces)
    claimed = [topic for topic in grant.publishes if not topic.startswith(below)]
    return {"enclave": grant.name, "key": key, "publishes": claimed} if swarm.sros2 else {}


def _path(grant: Grant, file: str) -> str:
    return f"{_FOLDER}/{grant.name}/{file}"


def _enclave(swarm: Swarm, grant: Grant) -> Enclave:
    folder, kept = keystore.folder(swarm.name, grant.name), swarm.keystore
    rules, allowed = governance(), permissions(swarm, grant)
    texts = {keystore.GOVERNANCE: rules, f"{folder}/{keystore.PERMISSIONS}": allowed}
    signed = all(keystore.in_signed(text) in kept.get(path, b"") for path, text in texts.items())
    complete = signed and {keystore.CA, f"{folder}/{keystore.CERTIFICATE}"} <= kept.keys()
    key = keystore.secret(grant.name)
    return Enclave(grant.name, f"/{grant.name}", folder, key, rules, allowed, complete)


def _files(swarm: Swarm, found: list[Grant]) -> Iterator[File]:
    kept, origin = swarm.keystore, "ros.sros2"
    yield File(PUT_ENCLAVE, shipped_files.text("ros2/put-enclave"), 0o755)
    yield File(_IDENTITY, kept.get(keystore.CA, b""), origin=origin)
    yield File(_PERMISSIONS, kept.get(keystore.CA, b""), origin=origin)
    yield File(_GOVERNANCE, kept.get(keystore.GOVERNANCE, b""), origin=origin)
    for grant in found:
        for file in (keystore.CERTIFICATE, keystore.PERMISSIONS):
            content = kept.get(f"{keystore.folder(swarm.name, grant.name)}/{file}", b"")
            yield File(_path(grant, file), content, origin=origin)


def _unit(swarm: Swarm, host: Host) -> bytes:
    return render(
        "ros2/enclaves.service",
        **service_values(swarm, host, master=False),
        runtime=names.runtime_folder(swarm.name, names.ENCLAVES),
        user=host.user,
        enclaves=[unit_values(swarm, one) for one in of_people(swarm, host)],
    )
