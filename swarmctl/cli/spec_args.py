"""SPEC and ``-f`` of every verb as one value: the spec's file and its overlays."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from pathlib import Path

import typer

USUAL = "swarm.yaml"  # the spec of a verb that names none, if the current folder has it


@dataclass(frozen=True)
class SpecFiles:
    """The files of one spec, each an overlay on those before. Files beside the spec are beside ``first``."""

    files: tuple[Path, ...]
    workspaces: tuple[Path, ...] = ()  # folders with ROS packages that the operator names

    @property
    def first(self) -> Path:
        """The spec's own file; the others are overlays."""
        return self.files[0]

    def command(self, verb: str, *more: str) -> str:
        """Returns the command line ``swarmctl VERB SPEC MORE``; SPEC is left out where it may be."""
        overlays = self.files[1:]
        named = [] if self.first == Path(USUAL) and not overlays else [str(self.first)]
        named += [word for file in overlays for word in ("-f", str(file))]
        return shlex.join(["swarmctl", *verb.split(), *named, *more])

    def fix_command(self, fixable: int, guesses: int) -> str:
        """Returns the command that applies the safe fixes, or else shows the guesses; empty without any."""
        options = ["--fix"] if fixable else ["--unsafe-fixes", "--diff"]
        workspaces = [word for folder in self.workspaces for word in ("--workspace", str(folder))]
        return self.command("validate", *workspaces, *options) if fixable or guesses else ""

    def __str__(self) -> str:
        return " -f ".join(map(str, self.files))


def file(name: str) -> SpecFiles:
    """Returns the argument SPEC as a value."""
    return SpecFiles((Path(name),))


def given(context: typer.Context, spec: SpecFiles | None) -> SpecFiles | None:
    """SPEC with the overlays; without SPEC, the first overlay is the spec. None without any file."""
    overlays = tuple(context.params.get("overlays") or ())
    files = (*(spec.files if spec else ()), *overlays)
    workspaces = tuple(context.params.get("workspaces") or ())
    return SpecFiles(files, workspaces) if files else None


def needed(context: typer.Context, spec: SpecFiles | None) -> SpecFiles | None:
    """The same, for a verb that requires a spec: without one, ``swarm.yaml`` of the current folder.

    Raises ``typer.BadParameter`` without that, too.
    """
    found = given(context, spec) or given(context, usual())
    if found is None and not context.resilient_parsing:
        raise typer.BadParameter(f"missing argument SPEC, the YAML file of the swarm; no {USUAL} is here")
    return found


def needed_without_report(context: typer.Context, spec: SpecFiles | None) -> SpecFiles | None:
    """The same, but none with ``--from ARCHIVE``; raises ``typer.BadParameter`` for both."""
    if context.params.get("archive") is None:
        return needed(context, spec)
    if given(context, spec):
        raise typer.BadParameter("SPEC and --from exclude each other")
    return None


def usual() -> SpecFiles | None:
    """Returns the spec of the current folder, if it has one."""
    return file(USUAL) if Path(USUAL).is_file() else None


def is_spec(word: str) -> bool:
    """Returns True if the first argument of a verb is the file of a spec, rather than what it is about.

    That is a robot, a host, or a topic such as ``/k3/odom``.
    """
    is_path = "/" in word and not word.startswith("/")
    return word.endswith((".yaml", ".yml")) or is_path or Path(word).is_file()


def each(context: typer.Context, specs: list[SpecFiles] | None) -> list[SpecFiles | None]:
    """The same for several specs: the overlays apply to each of them."""
    return [needed(context, spec) for spec in (specs or (None,))]
