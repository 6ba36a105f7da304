"""A trial once more: the spec of its capsule, if that still gives the same releases."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from swarmctl.cli import console, exit_codes
from swarmctl.cli.spec_args import SpecFiles
from swarmctl.version import __version__

if TYPE_CHECKING:
    from swarmctl.capsule.capsule_index import Index
    from swarmctl.cli.swarm_look import Expected
    from swarmctl.cli.where import Where


@contextmanager
def replayed(where: Where, capsule: Path) -> Iterator[tuple[Where, Index]]:
    """Gives the spec of a capsule in place of the operator's, with the pins and public keys beside that.

    Hosts keep the secrets that they have. Ends the program if the capsule is not intact.
    """
    from swarmctl.capsule import folder as capsules
    from swarmctl.capsule.capsule_index import CapsuleError
    from swarmctl.deploy.secrets import FOLDER
    from swarmctl.remote.known_hosts import path_beside
    from swarmctl.spec.wireguard_keys import path as keys_of

    try:
        index, problems = capsules.read(capsule), capsules.problems(capsule)
    except CapsuleError as error:
        console.fail(str(error), error.help)
    if problems:
        console.fail(f"{capsule} has changed: {problems[0]}", "`swarmctl capsule verify` lists all")
    with tempfile.TemporaryDirectory(prefix="swarmctl-replay-") as place:
        files = tuple(Path(place, one) for one in index.spec)
        operators, own, keys = where.spec.first.absolute(), files[0], keys_of(index.swarm)
        pins = path_beside(operators), path_beside(own)
        try:
            shutil.copytree(capsule / "spec", Path(place, "spec"))
            for path, file in index.files.items():
                if path.startswith("spec/") and file.executable is not None:
                    Path(place, path).chmod(0o700 if file.executable else 0o600)
            shutil.rmtree(own.with_name(FOLDER), ignore_errors=True)
            for there, here in (pins, (operators.with_name(keys), own.with_name(keys))):
                here.unlink(missing_ok=True)
                if there.is_file():
                    shutil.copyfile(there, here)
        except (OSError, ValueError) as error:
            console.fail(f"{capsule} has no spec that can be read: {error}")
        yield replace(where, spec=SpecFiles(files)), index


def require_same(wanted: Expected, index: Index) -> None:
    """Ends the program unless the releases are those of the capsule; names the hosts where they differ."""
    from swarmctl.render.build_bundle import bundles

    made = {host: one.digest for host, one in bundles(wanted.swarm).items()}
    for host in (host for host, one in index.hosts.items() if not one.release):
        console.show(f"the capsule does not know the release of {host}: it may be another", error=True)
    hosts = [host for host, one in index.hosts.items() if one.release and made.get(host) != one.release]
    if hosts:
        version = "" if index.swarmctl == __version__ else f", which {index.swarmctl} has made"
        console.fail(
            f"other releases than in the capsule{version}: {', '.join(hosts)}",
            f"use swarmctl {index.swarmctl}, and the packages as they were built then"
            if version
            else "packages were built anew since, or keys of the swarm have changed",
            code=exit_codes.ERROR,
        )
