"""The enclaves of SROS 2: which process has which key, and what it may publish. Pure.

Each driver, gate and program has an enclave, and each host one for people and for `swarmctl status`. Within
an island every enclave may subscribe to everything, and publish what nobody owns. Owned are the names in a
robot's namespace, the commands of a robot, and what programs declare.
Source: OMG DDS Security 1.1, 9.4.1 (governance, permissions); names of topics in DDS: design.ros2.org,
"Topic and Service name mapping to DDS".
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from swarmctl.render import expected_nodes, shipped_files
from swarmctl.render.bundle import Enclave, File, Part, SecretForm, Unit
from swarmctl.render.quoting import render
from swarmctl.render.service_values import service_values
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.spec import keystore
from swarmctl.swarm import names
from swarmctl.swarm.resolved import Host, Island, Program, Robot, Swarm
from swarmctl.swarm.topics import DIAGNOSTICS, actuators_of

#: On these, nodes publish that no spec declares.
_SHARED = ("/tf", "/tf_static", "/rosout", "/parameter_events", DIAGNOSTICS)


@dataclass(frozen=True)
class Grant:
    """What may be published in an enclave. ``name`` is its path, such as ``robots/k3``; ``node`` runs in it.

    That are the topics in ``publishes``, and in ``spaces`` all names that no other has declared.
    """

    name: str
    host: str
    node: str
    publishes: tuple[str, ...]
    spaces: tuple[str, ...]


def on_host(swarm: Swarm, host: Host) -> Iterator[Grant]:
    """Yields the enclaves of ``host``."""
    yield of_host(swarm, host)
    for robot in swarm.robots_on(host.name):
        yield of_driver(swarm, robot)
        if robot.gated:
            yield of_gate(swarm, robot)
    for program in swarm.programs_on(host.name):
        yield of_program(swarm, program)


def of_host(swarm: Swarm, host: Host) -> Grant:
    """Returns the enclave of people at a terminal of ``host``, and of what looks at its graph."""
    return Grant(f"hosts/{host.name}", host.name, "", _commands(swarm, host.name, ""), ())


def of_driver(swarm: Swarm, robot: Robot) -> Grant:
    """Returns the enclave of the driver of ``robot``."""
    topics = tuple(robot.full_name(one.name) for one in robot.topics)
    commands = _commands(swarm, robot.host, robot.driver_node)
    return Grant(
        f"robots/{robot.name}", robot.host, robot.driver_node, (*topics, *commands), (robot.namespace,)
    )


def of_gate(swarm: Swarm, robot: Robot) -> Grant:
    """Returns the enclave of the gate in front of the driver of ``robot``."""
    output = f"{robot.namespace}/{names.GATE_OUTPUT}"
    return Grant(f"gates/{robot.name}", robot.host, robot.gate_node, (output,), (robot.namespace,))


def of_program(swarm: Swarm, program: Program) -> Grant:
    """Returns the enclave of a program, whatever nodes it starts."""
    declared = tuple(topic for topic, _ in expected_nodes.program(swarm, program).publishes)
    commands = _commands(swarm, program.host, program.node)
    spaces = {robot.namespace for robot in swarm.robots.values()}.intersection(names.above(program.node))
    topics = tuple(dict.fromkeys((*declared, *commands)))
    return Grant(f"programs/{program.name}", program.host, program.node, topics, tuple(sorted(spaces)))


def permissions(swarm: Swarm, grant: Grant) -> bytes:
    """Returns what may be done in an enclave, as the authority of the keystore signs it."""
    island, own = swarm.island_of(grant.host), (*grant.publishes, *_SHARED)
    others = [one.namespace for one in swarm.robots.values() if one.namespace not in grant.spaces]
    closed = tuple(f"{space}/" for space in others)
    owned = [one for one in _owned(swarm, island) if one not in own and not one.startswith(closed)]
    return render(
        "ros2/permissions.xml",
        grant=f"/{grant.name}",
        subject=f"CN=/{grant.name}",
        domain=island.discovery.domain,
        rules=[
            ("allow_rule", [f"rt{one}" for one in grant.publishes]),
            ("deny_rule", [f"rt{one}" for one in dict.fromkeys(owned)]),
            ("allow_rule", _below(grant.spaces)),
            ("deny_rule", _below(others)),
        ],
    )


def governance() -> bytes:
    """Returns what holds for all enclaves: everything is encrypted, and nobody joins without a key."""
    return render("ros2/governance.xml")


def _below(spaces: tuple[str, ...] | list[str]) -> list[str]:
    """The topics in namespaces, and the replies of services, as DDS knows them."""
    return [f"{kind}{space}/*" for space in spaces for kind in ("rt", "rr")]


def _commands(swarm: Swarm, host: str, node: str) -> tuple[str, ...]:
    """What ``node`` on ``host`` may command, and set on robots that it commands."""
    address = swarm.hosts[host].advertised
    return tuple(
        topic
        for robot in swarm.robots.values()
        if any(one.includes(node, address) for one in robot.commanders)
        for topic in _taken(robot)
    )


def _taken(robot: Robot) -> Iterator[str]:
    """The topics on which a robot takes commands and settings."""
    if robot.command is not None:
        yield robot.command.topic
    if isinstance(robot.type, RobotType):
        yield from (f"{robot.namespace}/{name}" for name in actuators_of(robot.type))


def _owned(swarm: Swarm, island: Island) -> Iterator[str]:
    """The topics of ``island`` that only those may publish who declare them."""
    for robot in swarm.robots.values():
        if robot.host in island.hosts:
            yield from _taken(robot)
            yield from (robot.full_name(one.name) for one in robot.topics)
            if robot.gated:
                yield f"{robot.namespace}/{names.GATE_OUTPUT}"
    for program in swarm.programs.values():
        if program.host in island.hosts:
            yield from (topic for topic, _ in expected_nodes.program(swarm, program).publishes)


PUT_ENCLAVE = "bin/put-enclave"
_FOLDER = "enclaves"
_IDENTITY, _PERMISSIONS, _GOVERNANCE = (
    f"{_FOLDER}/{name}"
    for name in ("identity_ca.cert.pem", "permissions_ca.cert.pem", "governance.p7s")
)  # fmt: skip


def enclave_part(swarm: Swarm, host: Host) -> Part:
    """Returns what the enclaves of ``host`` consist of, and the names of their keys."""
    if not swarm.sros2:
        return Part()
    found, forms = list(on_host(swarm, host)), dict[str, SecretForm]()
    for one in found:
        forms[keystore.secret(one.name)] = "text"
    name = names.unit(swarm.name, names.ENCLAVES)
    unit, people = File(f"units/{name}", _unit(swarm, host), origin="ros.sros2"), list(of_people(swarm, host))
    read = dict.fromkeys(
        path for one in people for path in (*enclave_needs(swarm, one), _path(one, keystore.PERMISSIONS))
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


def enclave_needs(swarm: Swarm, grant: Grant) -> tuple[str, ...]:
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
