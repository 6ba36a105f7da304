"""``python -m tests.attacks``: attacks the example at each level of `security`; prints what succeeds.

It needs root, for the lab. It exits with 1 if an attack succeeds that `security` is to refuse.
"""

from __future__ import annotations

import argparse
import os
import shutil
import signal
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from swarmctl.lab import paths
from tests import ROOT
from tests.attacks.attacks import ATTACKS, carried_out
from tests.attacks.positions import POSITIONS, prepare
from tests.attacks.table import Attack, Setting, Verdict, failures, lines
from tests.attacks.world import Observer
from tests.e2e.lab_swarm import LabSwarm, lab_of

SPEC = ROOT / "examples/paper-leader/swarm.yaml"


def main() -> int:
    calls = [one.call for one in ATTACKS]
    parser = argparse.ArgumentParser(
        prog="python -m tests.attacks", description=__doc__, epilog=f"The attacks: {', '.join(calls)}."
    )
    parser.add_argument("--only", nargs="+", choices=calls, default=calls, metavar="ATTACK")
    parser.add_argument(
        "--at", nargs="+", type=Setting, default=list(Setting), metavar="LEVEL", help="off, filtered, sealed"
    )
    options = parser.parse_args()
    attacks = [one for one in ATTACKS if one.call in options.only]
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # the lab does not outlive it
    cells: dict[tuple[str, str, Setting], Verdict] = {}
    for setting in options.at:
        with deployed(setting) as swarm:
            for call, key, (verdict, error) in attacked(swarm, attacks):
                line = f"{setting.value}: {key}: {call}: {verdict.value}{error and f' ({error})'}"
                print(line, file=sys.stderr, flush=True)
                cells[call, key, setting] = verdict
    positions = {one.key: one.what for one in POSITIONS}
    print(*lines(attacks, positions, cells), sep="\n")
    failed = failures(attacks, positions, cells)
    print(f"\n{len(failed)} succeed that security is to refuse", *failed, sep="\n  ")
    return int(bool(failed))


@contextmanager
def deployed(setting: Setting) -> Iterator[LabSwarm]:
    """The example in a lab of its own, with this `security`, whose hosts the attackers may use."""
    folder = Path(tempfile.mkdtemp(prefix="swarm-attacks-"))
    os.environ[paths.STATE_VARIABLE] = str(folder)
    try:
        with lab_of(f"attacks-{os.getpid()}", SPEC, folder) as swarm:
            security = f"security: {setting.value}\nmode: leader"
            attacked = swarm.variant("attacked", ("mode: leader", security))
            if setting is Setting.SEALED:
                pinned = swarm.swarmctl("trust", spec=attacked)
                assert pinned.status == 0, pinned.out + pinned.err
            run = swarm.deploy(attacked)
            assert run.status == 0, run.out + run.err
            prepare(swarm)
            yield swarm
    finally:
        shutil.rmtree(folder)


def attacked(swarm: LabSwarm, attacks: Sequence[Attack]) -> Iterator[tuple[str, str, tuple[Verdict, str]]]:
    """Yields the attack, the position, and what ``carried_out`` gives; each begins with a whole swarm."""
    observer = Observer(swarm)
    whole = observer.whole()
    for position in POSITIONS:
        with position.taken(swarm):
            for attack in attacks:
                if attack.applies(position.key):
                    yield attack.call, position.key, carried_out(observer, attack, position)
                    whole = observer.restored(whole)


if __name__ == "__main__":
    sys.exit(main())
