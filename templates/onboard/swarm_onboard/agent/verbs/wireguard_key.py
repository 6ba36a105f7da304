"""``wireguard_key``: the public WireGuard key of the host, and its change to the next one."""

from __future__ import annotations

from swarm_onboard.agent import files, known_keys, wireguard_key
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.agent.rpc import Report


class Request(NamedTuple):
    """The public WireGuard key of the host in a swarm; without a private one it makes one.

    ``known``: public keys of hosts that it keeps, in lines of ``tunnel.keys``; ``make_next``: the key to
    change to is wanted, too; ``use``: that one, whose public key this is, takes the place of its key;
    ``expel``: a host whose keys are retired here.
    """

    swarm: str
    known: str = ""
    expel: str = ""
    make_next: bool = False
    use: str = ""


class Answer(NamedTuple):
    """The public key in base64, and the next one, empty if there is none."""

    public: str
    next: str


def handle(request: Request, payload: bytes, report: Report) -> Answer:
    """Returns the keys. Raises ``RefusedError`` and ``FailedError``."""
    home = home_of(request.swarm)
    known_keys.learn(home, str(request.known))
    if request.expel:
        wireguard_key.expel(home, str(request.expel))
    if request.use:
        wireguard_key.change_to(home, str(request.use))
    following = wireguard_key.next_public(home, make=bool(request.make_next))
    public = wireguard_key.public(home)
    files.sync(known_keys.folder(home))  # what an agent that was killed has made, too
    return Answer(public, following)
