"""Tables of examples of which `make test` takes some, and `make test-all` all."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any

import pytest


def some_of(examples: Iterable[object], taken: Collection[object]) -> list[Any]:
    """Return ``examples`` for `parametrize`; all that are not ``taken`` are slow."""
    return [pytest.param(example, marks=() if example in taken else pytest.mark.slow) for example in examples]
