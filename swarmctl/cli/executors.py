"""``--executor``: where the SSH sessions of a verb are, in this process or in workers elsewhere."""

from __future__ import annotations

import os
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


NoReuse = Annotated[
    bool,
    typer.Option(
        "--no-reuse", envvar="SWARMCTL_NO_REUSE", show_envvar=False,
        help="Log in anew, and keep no connection: without it, the next verb within 60 s uses this one's.",
    ),
]  # fmt: skip


@contextmanager
def transport(
    executor: str, *, in_lab: bool, secrets: bool = False, reuse: bool = False
) -> Iterator[Transport]:
    """What connects to hosts. ``secrets``: the operator has some of theirs. Exits if there are no workers.

    ``reuse``: with connections that were kept by the verb before; none is if ``sudo`` needs a password.
    """
    if not executor:
        ssh = ssh_targets.transport()
        if reuse and not os.environ.get(ssh_targets.SUDO_PASSWORD_FILE):
            from swarmctl.remote.kept_connections import KeptConnections

            yield KeptConnections(ssh)
        else:
            yield ssh
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
