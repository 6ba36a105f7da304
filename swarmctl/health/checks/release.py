"""What a deploy left on a host: its release, what was edited of it, a change that is open. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from swarm_onboard.agent import record
from swarm_onboard.agent.deployed import Transaction
from swarm_onboard.agent.edits import Drift

from swarmctl.health.check_context import CheckContext
from swarmctl.health.expected_graph import ExpectedHost
from swarmctl.health.root_cause import Findings
from swarmctl.health.verdict import Verdict, bad, listed, ok, warning

FILES, CHANGE = "files", "change"
TABLE = {
    "release": (
        ("nothing of the swarm is deployed on a host", "unhealthy, in front of all other causes"),
        ("it has another release than the spec renders", "a warning"),
    ),
    CHANGE: (
        ("a change was interrupted, and is neither finished nor undone", "unhealthy"),
        (
            "a change is under way, or waits for its confirmation",
            "a warning; files are not compared while it is under way",
        ),
    ),
    FILES: (
        (
            "a file of the release, its block in `/etc/hosts` or a link was changed or is missing",
            "unhealthy; `swarmctl adopt` keeps edits in the spec, `deploy --overwrite-edits` replaces them",
        ),
        ("the units do not start at boot: a link is missing", "unhealthy"),
        ("files were added to the release", "a warning"),
    ),
}
_OPEN = (record.APPLYING, record.PENDING, record.UNDOING, record.REMOVING)
_AT_BOOT = "/etc/systemd/system/multi-user.target.wants/"
_WHAT = {
    "changed": "was changed on the host",
    "missing": "is missing",
    "damaged": "is damaged",
    "broken": "has lost a line that marks the swarm's block",
    "foreign": "is not swarmctl's",
    "extra": "is not part of the release",
}
_CACHE = "__pycache__"
_REDEPLOY = "run swarmctl deploy"
_ADOPT = "`swarmctl adopt` brings edits into the spec; `swarmctl deploy --overwrite-edits` replaces them"


def compare(found: Findings, context: CheckContext) -> None:
    """Files one finding for each part that a host reports."""
    for host, answer in context.hosts:
        if answer.release is not None or "release" not in answer.troubles:
            found.add("release", host.name, _release(host, answer.release), host=host)
        if answer.change is not None:
            found.add(CHANGE, host.name, _change(host, answer.change, answer.holder), host=host)
        if answer.drift is not None and answer.holder is None:
            found.add(FILES, host.name, _drift(answer.drift), host=host, after=[f"{CHANGE} {host.name}"])


def _release(host: ExpectedHost, seen: str | None) -> Verdict:
    """Compares the release. Another one is only a warning: robots may well drive with it."""
    if seen is None:
        return bad("nothing is deployed", _REDEPLOY)
    if seen != host.release.digest:
        return warning(f"runs {seen}, the spec renders {host.release.digest}", _REDEPLOY)
    return ok(f"runs {seen}")


def _change(host: ExpectedHost, seen: Transaction, holder: str | None) -> Verdict:
    if holder is not None:
        return warning(f"is under way: {holder}", "look again when it has ended")
    if seen.state == record.PENDING and seen.left > 0:
        text = f"of {seen.who} waits for its confirmation, and is undone in {seen.left:.0f} s without it"
        return warning(text, "look again then")
    if seen.state in _OPEN:
        text = f"of {seen.who} was interrupted, and is neither finished nor undone"
        error = f": {seen.error}" if seen.error else ""
        return bad(text + error, f"{_REDEPLOY}, which settles it, on {host.name} too")
    return ok("none is open")


def _drift(seen: Drift) -> Verdict:
    """Compares with the release. What people have added is only a warning."""
    added = [path for path, what in seen.files.items() if what == "extra" and _CACHE not in path.split("/")]
    faults = [*_faults(seen.files), *_links(seen.links), *_blocks(seen.blocks)]
    if faults:
        states = {*seen.files.values(), *seen.links.values(), *seen.blocks.values()} - {"extra"}
        nothing_is_lost = states <= {"missing", "damaged"}
        return bad(listed(faults), _REDEPLOY if nothing_is_lost else _ADOPT)
    if added:
        text = f"{listed(sorted(added))} {'is' if len(added) == 1 else 'are'} not part of the release"
        return warning(text, "swarmctl deploy keeps a copy on the host and removes them")
    return ok("are as deployed")


def _faults(files: Mapping[str, str]) -> Iterator[str]:
    return (f"{path} {_WHAT.get(what, what)}" for path, what in files.items() if what != "extra")


def _links(links: Mapping[str, str]) -> Iterator[str]:
    for path, what in links.items():
        if what == "missing" and path.startswith(_AT_BOOT):
            yield f"{path[len(_AT_BOOT) :]} does not start at boot: its link is missing"
        else:
            yield f"{path} {_WHAT.get(what, what)}"


def _blocks(blocks: Mapping[str, str]) -> Iterator[str]:
    return (f"{path}: the swarm's block {_WHAT.get(what, what)}" for path, what in blocks.items())
