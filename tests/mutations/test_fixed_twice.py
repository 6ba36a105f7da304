"""Fixes made twice are those made once: what a fix writes needs no other fix."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import pytest

from swarmctl.linter.fixes import Findings, Texts, fixable
from swarmctl.yamltext.files import content
from tests.mutations.defects import Base, bases, defects
from tests.mutations.judge import lint
from tests.rules.specs import BROKEN, DOUBTFUL, specs_in

SPECS = [*specs_in(BROKEN.parent), *specs_in(BROKEN), *specs_in(DOUBTFUL)]  # the first has `fixable`


def lint_with(base: Base, before: Texts, texts: Texts) -> Findings:
    return lint(base, {**before, **texts})


def original(before: Texts, file: str) -> str:
    return before[file] if file in before else content(Path(file)).decode("utf-8-sig")


@pytest.mark.parametrize(
    "base",
    [
        *(Base(f"{one.parent.name}: {one.stem}", (one,), ()) for one in SPECS),
        *(pytest.param(one, marks=pytest.mark.slow) for one in bases()),
    ],
    ids=lambda base: base.name,
)
def test_fixes_made_twice_are_those_made_once(base: Base) -> None:
    for wrong in [{str(one.file.path): one.change.text} for one in defects(base, 1)] or [{}]:
        once = fixable(partial(lint_with, base, wrong), partial(original, wrong))
        for done in (once.safe, once.all) if once.all.made else ():
            texts = {**wrong, **done.texts}
            again = fixable(partial(lint_with, base, texts), partial(original, texts))
            assert not (again.safe if done is once.safe else again.all).made
