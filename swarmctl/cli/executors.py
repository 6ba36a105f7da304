"""``--executor``: where the SSH sessions of a verb are, in this process or in workers elsewhere."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import console, exit_codes, ssh_targets

if TYPE_CHECKING:
    from swarmctl.remote.transport import Transport

Executor = Annotated[
    str,
    typer.Option(
        "--executor",
        metavar="dask://HOST:PORT",
        help="Have the workers of this Dask cluster connect to the hosts (see docs/scale.md).",
    ),
]


@contextmanager
def transport(executor: str, *, in_lab: bool, secrets: bool = False) -> Iterator[Transport]:
    """What connects to hosts. ``secrets``: the operator has some of theirs. Exits if there are no workers."""
    if not executor:
        yield ssh_targets.transport()
        return
    if in_lab:
        console.fail(
            "--executor and --lab exclude each other: workers cannot reach the hosts of a lab",
            code=exit_codes.USAGE,
        )
    from swarmctl.remote import dask_cluster
    from swarmctl.remote.either_ssh import EitherSsh

    login = partial(EitherSsh, ssh_targets.choice())
    try:
        address = dask_cluster.address_of(executor)
        with dask_cluster.workers(address, login=login, secrets=secrets) as found:
            yield found
    except dask_cluster.ClusterError as error:
        console.fail(f"--executor: {error}", error.fix)
