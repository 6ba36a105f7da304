"""A scenario file: faults, each with the first line of ``status`` that must name it, and its repair."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, Field, model_validator

from swarmctl.diagnostics import Diagnostic, has_errors
from swarmctl.field_types import Model
from swarmctl.lab.faults import kinds
from swarmctl.spec.validation import validated
from swarmctl.yamltext.source import parse


def _fault(line: str) -> str:
    kinds.read(line)
    return line


def _words(line: str) -> str:
    if not shlex.split(line):
        raise ValueError("write a verb of swarmctl, such as `deploy --yes`")
    return line


class Entry(Model):
    """One fault of a scenario: a ``fault`` of the lab, or a command on a host that is undone afterwards."""

    name: str = Field(min_length=1, description="What fails, in a few words.")
    fault: Annotated[str, AfterValidator(_fault)] | None = Field(
        None, description="The words of `lab fault` without the spec; `lab repair` ends it."
    )
    host: str | None = Field(None, description="The host of `run` and `undo`; or `operator`, this machine.")
    run: str | None = Field(None, description="A shell command that causes the fault, as root.")
    undo: str | None = Field(None, description="A shell command that repairs it, as root.")
    swarmctl: Annotated[str, AfterValidator(_words)] | None = Field(
        None, description="A verb with its options that repairs it, in place of `undo`."
    )
    first: str = Field(min_length=1, description="How the first finding of status begins.")
    within: float = Field(10.0, gt=0.0, description="Seconds within which status says so.")

    @model_validator(mode="after")
    def _has_fault_and_repair(self) -> Entry:
        if (self.fault is None) == (self.run is None):
            raise ValueError("an entry has either `fault` or `run`")
        if self.fault is not None and (self.host or self.undo or self.swarmctl):
            raise ValueError("`host`, `undo` and `swarmctl` are for `run`: `lab repair` ends a `fault`")
        if self.run is not None and self.host is None:
            raise ValueError("`run` needs `host`, the host on which it runs")
        if self.run is not None and (self.undo is None) == (self.swarmctl is None):
            raise ValueError("`run` needs its repair: either `undo` or `swarmctl`")
        return self


class Scenario(Model):
    """The whole file."""

    faults: tuple[Entry, ...] = Field(min_length=1)


def read_scenario(path: Path) -> tuple[tuple[Entry, ...], tuple[Diagnostic, ...]]:
    """Returns the entries of a file, and its diagnostics."""
    try:
        text = path.read_text("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        return (), (Diagnostic("FILE001", f"cannot read {path}: {error}"),)
    return scenario_of(text, str(path))


def scenario_of(text: str, path: str) -> tuple[tuple[Entry, ...], tuple[Diagnostic, ...]]:
    """Returns the entries of a text, and its diagnostics."""
    source, found = parse(text, path)
    if has_errors(found):
        return (), tuple(found)
    scenario, wrong = validated(Scenario, source)
    return () if scenario is None else scenario.faults, (*found, *wrong)
