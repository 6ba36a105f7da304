"""Hosts that are held back since others failed, and what is printed of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from swarmctl.deploy.outcome import Outcome
from swarmctl.remote.parallel_hosts import Finished
from swarmctl.remote.transport import HostError
from swarmctl.remote.transport import Kind as ErrorKind
from swarmctl.yamltext import hostlist


def held(waves: Sequence[Sequence[str]], because: str) -> Iterator[Finished[Outcome]]:
    """Yields the result of each host of these waves, which is left as it is."""
    error = HostError(ErrorKind.HELD, because)
    return (Finished(host, error, 0.0) for wave in waves for host in wave)


def why(failed: Mapping[str, HostError]) -> str:
    """Returns why hosts are held back: the failed ones, those of the same kind together."""
    kinds: dict[str, list[str]] = {}
    for host, error in failed.items():
        words = {ErrorKind.UNFIT: "cannot run its part", ErrorKind.UNREACHABLE: "does not answer"}
        words[ErrorKind.BUSY] = "has a robot that must not be touched now"
        words[ErrorKind.EDITED] = "has files that were edited there"
        text = words.get(error.kind, "failed")
        if error.kind is ErrorKind.REFUSED:
            text = f"is {error}" if _locked(error) else f"refused it: {error}"
        kinds.setdefault(text, []).append(host)
    return "; ".join(f"{hostlist.written(sorted(hosts))} {text}" for text, hosts in kinds.items())


def locked_ones(failed: Mapping[str, HostError]) -> dict[str, HostError]:
    """Returns the errors of the hosts that another operator changes, or whose change waits there."""
    return {host: error for host, error in failed.items() if _locked(error)}


def _locked(error: HostError) -> bool:
    return error.kind is ErrorKind.REFUSED and str(error).startswith("locked by ")
