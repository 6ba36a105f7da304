"""``python -m tests.power``: cuts the power of a host, and prints what it was after the next boot."""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context

from tests.power import isolated
from tests.power.cuts import RANDOM, Effort, Job, Row, run
from tests.power.disk import FILE_SYSTEMS, LOGS, missing
from tests.power.host_states import expected
from tests.power.scenes import SCENES


def main() -> int:
    """Returns 1 if a host was mixed."""
    parser = argparse.ArgumentParser(prog="python -m tests.power", description=__doc__)
    parser.add_argument("--system", action="append", choices=FILE_SYSTEMS, help="default: all")
    parser.add_argument("--scene", action="append", choices=[one.name for one in SCENES], help="default: all")
    parser.add_argument("--log", action="append", choices=LOGS, help="what a cut leaves of it; default: all")
    parser.add_argument("--sparse", type=int, default=1, metavar="N", help="cut at each Nth system call")
    parser.add_argument("--random", type=int, default=20, metavar="N", help="cuts at random instants a scene")
    parser.add_argument(
        "--deploys-each", type=int, default=5, metavar="N", help="deploy again on each Nth image"
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", action="store_true", help="end with the first that is wrong")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--json", action="store_true")
    chosen = parser.parse_args()
    if lacks := isolated.missing():
        sys.exit(f"power cuts need {lacks}")
    jobs: list[Job] = []
    for system in chosen.system or FILE_SYSTEMS:
        if lacks := missing(system):
            print(f"{system} is left out: this machine lacks {lacks}", file=sys.stderr)
            continue
        for number, scene in enumerate(SCENES):
            if not chosen.scene or scene.name in chosen.scene:
                for log in chosen.log or LOGS:
                    at_random = bool(chosen.random) and FILE_SYSTEMS[system].cuts and log != "once"
                    kinds = (False, True) if at_random else (False,)
                    jobs += [Job(system, log, number, kind) for kind in kinds]
    began = time.monotonic()
    effort = Effort(chosen.sparse, chosen.random, chosen.seed, chosen.deploys_each, chosen.first)
    work = partial(run, known=expected(), effort=effort)
    with ProcessPoolExecutor(chosen.jobs, get_context("spawn"), max_tasks_per_child=1) as pool:
        done = pool.map(work, jobs)
        rows = list(until_wrong(done) if chosen.first else done if chosen.json else shown(done))
        pool.shutdown(cancel_futures=True)
    if chosen.json:
        print(json.dumps([vars(row) for row in rows]))
    else:
        conclude(rows, time.monotonic() - began)
    return int(any(row.wrong for row in rows))


def until_wrong(rows: Iterable[Row]) -> Iterator[Row]:
    """Yields rows up to the first with something wrong."""
    for row in rows:
        yield row
        if row.wrong:
            return


def shown(rows: Iterable[Row]) -> Iterator[Row]:
    """Prints a table, each row when it is complete."""
    line = "{:6} {:8} {:34} {:>5} {:>6} {:>7} {:>6} {:>6} {:>6} {:>6}"
    print(line.format("system", "log", "phase", "cuts", "images", "deploys", "old", "new", "none", "wrong"))
    for row in rows:
        old = sum(count for state, count in row.states.items() if state.startswith(("old", "between")))
        counts = (row.cuts, row.images, row.deploys, old, row.states["new"], row.states["none"])
        print(line.format(row.system, row.log, row.scene, *counts, len(row.wrong)), flush=True)
        yield row


def conclude(rows: Sequence[Row], seconds: float) -> None:
    """Prints the sums by file system and in all, what was wrong, and what was left over in nobody's way."""
    for system in dict.fromkeys(row.system for row in rows):
        own = [row for row in rows if row.system == system]
        at_random = sum(row.cuts for row in own if row.scene.endswith(RANDOM))
        at_calls = sum(row.cuts for row in own) - at_random
        images, deploys = sum(row.images for row in own), sum(row.deploys for row in own)
        print(
            f"{system}: {at_calls} cuts at system calls, {at_random} at random instants, "
            f"{images} different images, {deploys} deployed to again"
        )
    cuts, images = sum(row.cuts for row in rows), sum(row.images for row in rows)
    wrong = sum(len(row.wrong) for row in rows)
    print(f"{cuts} power cuts, {images} different images, in {seconds:.0f} s: {wrong} wrong")
    for row in rows:
        print(*row.wrong, sep="\n", end="\n" if row.wrong else "")
    leftovers: Counter[str] = Counter()
    for row in rows:
        leftovers.update(
            {f"{row.scene.partition(RANDOM)[0]}: {name}": n for name, n in row.leftovers.items()}
        )
    for name, count in sorted(leftovers.items()):
        print(f"left over until the next change, {name} ({count} cuts)")


if __name__ == "__main__":
    sys.exit(main())
