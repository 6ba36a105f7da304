"""No test is failed by a clock: none compares seconds, of the wall or of the CPU, with a constant.

A lower bound is no such comparison: nothing happens too early because a machine is slow. Seconds are what a
clock returned, what was computed from that, and names that say so.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest

from tests import ROOT

CLOCKS = {"time", "monotonic", "perf_counter", "process_time", "thread_time"}
SECONDS = {"took", "seconds", "elapsed", "stood", "stands", "waited", "late", "lasted", "spent", "duration"}
Function = ast.FunctionDef | ast.AsyncFunctionDef
#: A time that is promised is compared here with its bar, by `make bench` alone.
EXEMPT = {"tests/conftest.py", "tests/timing.py"}


def comparisons(code: str) -> Iterator[int]:
    """Yield the lines of ``code`` with an assertion that seconds are below what is no other moment."""
    tree = ast.parse(code)
    functions = [node for node in ast.walk(tree) if isinstance(node, Function)]
    for function in functions:
        moments, computed = _names_of_times(function)
        for node in ast.walk(function):
            if isinstance(node, ast.Assert):
                seconds = moments | computed | SECONDS
                yield from (
                    below.lineno
                    for below, bound in _upper_bounds(node.test)
                    if _has_seconds(below, seconds) and not _is_moment(bound, moments)
                )
                yield from (part.lineno for part in ast.walk(node) if _is_near_a_moment(part, moments))


def _names_of_times(function: Function) -> tuple[set[str], set[str]]:
    """Return the names of what a clock returned, and of what is computed from it."""
    moments: set[str] = set()
    computed: set[str] = set()
    assignments = [node for node in ast.walk(function) if isinstance(node, ast.Assign)]
    for _ in assignments:
        for node in assignments:
            for target, value in _assigned(node):
                if _is_clock(value):
                    moments.add(target)
                elif _has_seconds(value, moments | computed):
                    computed.add(target)
    return moments, computed


def _assigned(node: ast.Assign) -> Iterator[tuple[str, ast.expr]]:
    for target in node.targets:
        if isinstance(target, ast.Name):
            yield target.id, node.value
        elif isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
            pairs = zip(target.elts, node.value.elts, strict=False)
            yield from ((name.id, value) for name, value in pairs if isinstance(name, ast.Name))


def _upper_bounds(test: ast.expr) -> Iterator[tuple[ast.expr, ast.expr]]:
    """Yield each expression that must be below another one, with that one."""
    for node in ast.walk(test):
        if isinstance(node, ast.Compare):
            for (left, right), operator in zip(
                pairwise([node.left, *node.comparators]), node.ops, strict=True
            ):
                if isinstance(operator, ast.Lt | ast.LtE):
                    yield left, right
                elif isinstance(operator, ast.Gt | ast.GtE):
                    yield right, left


def _is_clock(node: ast.expr) -> bool:
    return (
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and isinstance(node.func.value, ast.Name)
        and node.func.value.id == "time"
        and node.func.attr.removesuffix("_ns") in CLOCKS
    )


def _has_seconds(node: ast.expr, names: set[str]) -> bool:
    return any(
        (isinstance(part, ast.Name) and part.id in names)
        or (isinstance(part, ast.Attribute) and part.attr in SECONDS)
        or (isinstance(part, ast.Call) and (_is_clock(part) or _returns_seconds(part)))
        for part in ast.walk(node)
    )


def _returns_seconds(call: ast.Call) -> bool:
    name = call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")
    return name == "until" or name.startswith("seconds_")


def _is_near_a_moment(node: ast.AST, moments: set[str]) -> bool:
    return (
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and node.func.attr == "approx"
        and _has_seconds(node.args[0], moments)
    )


def _is_moment(node: ast.expr, moments: set[str]) -> bool:
    return _is_clock(node) or (isinstance(node, ast.Name) and node.id in moments)


@pytest.mark.parametrize(
    "code",
    [
        "assert time.monotonic() - began < 2",
        "assert 0.1 < time.process_time() - began <= 2 * LIMIT",
        "took = time.monotonic() - began\n  assert 5 > took",
        "end = time.monotonic() + 5\n  while busy(): assert time.monotonic() < end",
        "assert stop().seconds < BAR, 'late'",
        "assert found == pytest.approx(time.time(), abs=5)",
        "back = until(stands, 'it drives')\n  assert back < 1",
        "a, b = time.time(), 3\n  assert not busy() or time.time() - a < b",
    ],
)
def test_a_comparison_of_seconds_is_found(code: str) -> None:
    assert [*comparisons(f"def test():\n  began = time.monotonic()\n  {code}\n")]


@pytest.mark.parametrize(
    "code",
    [
        "assert time.monotonic() - began >= 0.2",
        "later = time.monotonic()\n  assert began < later",
        "assert len(found) < 3",
        "while time.monotonic() < began + 3: look()",
    ],
)
def test_what_no_slow_machine_breaks_is_allowed(code: str) -> None:
    assert not [*comparisons(f"def test():\n  began = time.monotonic()\n  {code}\n")]


def test_no_test_compares_seconds_with_a_constant() -> None:
    found = [
        f"{file}:{line}: no verdict by a clock; see tests/README.md, Time"
        for path in sorted((ROOT / "tests").rglob("*.py"))
        if (file := str(path.relative_to(ROOT))) not in EXEMPT
        for line in comparisons(Path(path).read_text("utf-8"))
    ]
    assert not found, "\n" + "\n".join(found)
