"""What the clock of a host follows, where swarmctl has configured chrony."""

from __future__ import annotations

from swarm_onboard.agent import command, files, preflight, system_links
from swarm_onboard.agent.named_tuple import NamedTuple
from swarm_onboard.host_checks import Judged

TYPE_CHECKING = False
if TYPE_CHECKING:
    from swarm_onboard.agent.release_store import Home

TABLE = (
    ("chronyd does not run, where the host has a clock of its own", "a warning"),
    ("its clock is not synchronised, or follows another one than the release says", "a warning"),
)
_CONF = "/etc/chrony/chrony.conf"
_PATIENCE = 3.0  # s
_SOURCE, _LEAP = 1, 13  # fields of `chronyc -c tracking` (chronyc(1)): the source's address, the leap status
_NOT_SYNCHRONISED = "Not synchronised"


class Seen(NamedTuple):
    """What chronyd ``wants`` to follow by the release, and its ``source``; without one, it is the root.

    ``leap``: chronyd's leap status, empty where it does not answer. ``same``: whether both are one host, None
    where that is not known.
    """

    wants: str
    source: str
    leap: str
    same: bool | None


def observe(home: Home) -> list[Seen]:
    """Asks chronyd, whose lines of this swarm are in its file. Raises ``OSError``, ``RefusedError``."""
    text = system_links.text_in(files.read(home.outside(_CONF)) or b"", home.swarm)
    chronyc = preflight.found(["chronyc"], home.outside)["chronyc"]
    if text is None or chronyc is None:
        return []
    lines = [line.split() for line in text.decode("utf-8", "replace").splitlines()]
    is_root = any(words[:1] == ["local"] for words in lines)
    servers = [words[1] for words in lines if words[:1] == ["server"] and len(words) > 1]
    wants = servers[0] if servers and not is_root else ""
    output = command.output_of([home.outside(chronyc), "-n", "-c", "tracking"], _PATIENCE)
    fields = output.strip().split(",")
    if len(fields) <= _LEAP:
        # A container has the clock of its machine, and systemd starts no chronyd there.
        return [] if preflight.clock() == "borrowed" else [Seen(wants, "", "", None)]
    addresses = _addresses(wants) if wants else []
    same = fields[_SOURCE] in addresses if addresses else None
    return [Seen(wants, fields[_SOURCE], fields[_LEAP], same)]


def _addresses(name: str) -> list[str]:
    lines = command.output_of(["getent", "ahosts", name], _PATIENCE).splitlines()
    return [line.split()[0] for line in lines if line.strip()]


def judge(seen: Seen, host: str) -> Judged:
    """Warns of a clock that drifts away from the others'."""
    sources = f"on {host}, for what it can follow: chronyc -n sources"
    if not seen.leap:
        text = "chronyd does not answer: its clock drifts away from the others'"
        return Judged("warning", text, f"on {host}: systemctl status chrony; sudo journalctl -u chrony")
    if seen.leap == _NOT_SYNCHRONISED:
        text = f"{seen.wants} has not given it the time" if seen.wants else "it gives the others no time"
        return Judged("warning", f"its clock is not synchronised: {text}", sources)
    if seen.same is False:
        text = f"its clock follows {seen.source or 'nobody'} instead of {seen.wants}"
        return Judged("warning", f"{text}, which does not answer or disagrees", sources)
    follows = seen.wants or seen.source
    return Judged("ok", f"its clock follows {follows}" if follows else "serves its own time")
