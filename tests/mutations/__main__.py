"""Prints the rates of all defects, and those that pass: ``python -m tests.mutations [MOST]``."""

from __future__ import annotations

import sys
from collections import Counter

from tests.mutations.defects import MISTAKES, bases, defects
from tests.mutations.judge import Outcome, judged


def main() -> None:
    """Checks every defect and prints what came of it."""
    most = int(sys.argv[1]) if len(sys.argv) > 1 else 2
    verdicts = [judged(one) for base in bases() for one in defects(base, most)]
    found = [one for one in verdicts if one.found]
    outcomes = Counter(one.after for one in verdicts)
    print(f"{len(verdicts)} defects of {len(MISTAKES)} kinds")
    print(f"found: {len(found)} ({len(found) / len(verdicts):.1%})")
    print(f"at the right line: {sum(one.at_the_line for one in found)} of these")
    for outcome in Outcome:
        print(f"after the certain fixes, {outcome.value}: {outcomes[outcome]}")
    for one in verdicts:
        if not one.found:
            print(f"passes: {one.defect}")
    for one in found:
        if not one.at_the_line:
            print(f"found elsewhere: {one.defect}: {one.found[0].code} {one.found[0].span}")
    for one in verdicts:
        if one.after is Outcome.OTHER:
            titles = {finding.fix.title for finding in one.found if finding.fix}
            print(f"fixed to another swarm: {one.defect}: {', '.join(sorted(titles))}")


if __name__ == "__main__":
    main()
