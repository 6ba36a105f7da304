"""How well robots follow commands: ``python benchmarks/motion.py [--page FILE]``; exit 1 beyond a bar.

Every robot type on its emulator, in time that nobody waits for, beside the papers' own formulas.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path


def main(arguments: Sequence[str] | None = None) -> int:
    from motion_quality import page, papers, paths, robots, verdict

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--page", type=Path, help="write the page of the documentation as well")
    given = parser.parse_args(arguments)
    results = {
        one.name: [verdict.row(one, manoeuvre) for manoeuvre in paths.manoeuvres(one.wheels)]
        for one in robots.entrants()
    }
    for name, rows in results.items():
        print(f"{name}\n\n{page.table(rows)}")
    if given.page:
        given.page.write_text(page.page(results, papers.FORMULAS, robots.left_out()), "utf-8")
    beyond = [(name, row) for name, rows in results.items() for row in rows if row.misses]
    for name, row in beyond:
        print(f"BEYOND ITS BAR: {name}, {row.manoeuvre.name}: {', '.join(row.misses)}")
    return 1 if beyond else 0


if __name__ == "__main__":
    sys.exit(main())
