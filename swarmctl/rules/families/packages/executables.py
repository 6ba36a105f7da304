"""The packages of programs, their executables and launch files exist, where packages are found."""

from __future__ import annotations

import posixpath
from collections.abc import Iterator
from dataclasses import replace

from swarmctl.diagnostics import Diagnostic, Fix, Span
from swarmctl.ros_packages.launched import Place
from swarmctl.ros_packages.package import Package
from swarmctl.rules.context import RuleContext, rule
from swarmctl.rules.launch_uses import declared_launches
from swarmctl.suggest import Guess, did_you_mean, guess
from swarmctl.yamltext.edits import make_fix, replace_value
from swarmctl.yamltext.source import Loc


@rule("PKG001", "PKG002", ros1=True)
def executables(context: RuleContext) -> Iterator[Diagnostic]:
    """An executable that its package does not have, or that may not be executed."""
    for name, program in context.spec.programs.items():
        package = context.document.packages.by_name.get(program.package or "")
        if package is None:
            continue
        if program.executable is not None:
            loc = ("programs", name, "executable")
            yield from _executable(context, loc, package, program.executable, f"program `{name}`")
    seen: set[tuple[Span, Place]] = set()
    for use in context.launches:
        span = context.launch_span(use, "launch")
        for node in use.launched.nodes:
            of_node = context.document.packages.by_name.get(node.package or "")
            if of_node is not None and node.executable and node.certain and (span, node.place) not in seen:
                seen.add((span, node.place))
                yield from _executable(context, span, of_node, node.executable, f"{node.place}")


def _executable(
    context: RuleContext, at: Loc | Span, package: Package, name: str, who: str
) -> Iterator[Diagnostic]:
    span = at if isinstance(at, Span) else context.span(*at)
    found = package.executable(name)
    if found is None and not package.is_computed:
        meant = guess(name, package.executables)
        yield Diagnostic(
            "PKG001",
            f"package `{package.name}` ({package.folder}) has no executable `{name}`, which {who} starts",
            span,
            label="not found in the package",
            help=did_you_mean(name, package.executables, f"executables of {package.name}"),
            fix=None if isinstance(at, Span) else _write(context, at, meant),
        )
    elif found is False:
        path = next(one for one in package.files if posixpath.basename(one) == name)
        yield Diagnostic(
            "PKG002",
            f"`{path}` of package `{package.name}` is not executable, and {who} starts it",
            span,
            label="roslaunch does not find it",
            help=(
                f"run `chmod +x {posixpath.join(package.folder, path)}`",
                "or install it in CMakeLists.txt by `catkin_install_python(PROGRAMS ...)`",
            ),
        )


@rule("PKG003", ros1=True)
def launch_files(context: RuleContext) -> Iterator[Diagnostic]:
    """A launch file that its package does not have."""
    packages, seen = context.document.packages.by_name, set()
    for use, _ in declared_launches(context) if packages else ():
        package, path = packages.get(use.started.package or ""), use.started.launch or ""
        span = context.launch_span(use, "launch")
        if package is None or f"launch/{path}" in package.files or span in seen:
            continue
        seen.add(span)
        base = posixpath.basename(path)
        elsewhere = [one for one in package.files if posixpath.basename(one) == base]
        meant = guess(path, package.launch_paths())
        yield Diagnostic(
            "PKG003",
            f"package `{package.name}` ({package.folder}) has no launch file `launch/{path}`",
            span,
            label="not found in the package",
            help=(f"move `{elsewhere[0]}` into the folder `launch` of the package",)
            if elsewhere and not meant.words
            else did_you_mean(path, package.launch_paths(), f"launch files of {package.name}"),
            fix=None if use.of_type else _write(context, (*use.loc, "launch"), meant),
        )


@rule("PKG016", ros1=True)
def misspelt(context: RuleContext) -> Iterator[Diagnostic]:
    """A package that is nowhere, and named like one that is found but for a typing error."""
    found = context.document.packages.by_name
    for loc, name in _named(context) if found else ():
        meant = guess(name, found)
        if name not in found and name not in context.messages.packages and meant.certain:
            near = found[meant.words[0]]
            yield Diagnostic(
                "PKG016",
                f"package `{name}` is not beside the spec, but `{near.name}` is ({near.folder})",
                context.span(*loc),
                label="probably misspelt",
                help=did_you_mean(name, found, "packages"),
                fix=_write(context, loc, replace(meant, certain=False)),  # a host may have a package so named
            )


def _named(context: RuleContext) -> Iterator[tuple[Loc, str]]:
    for name, program in context.spec.programs.items():
        if program.package is not None:
            yield ("programs", name, "package"), program.package
        for index, one in enumerate(program.requires):
            yield ("programs", name, "requires", index), one


def _write(context: RuleContext, loc: Loc, meant: Guess) -> Fix | None:
    if meant.only is None:
        return None
    edits = replace_value(context.source, loc, meant.only)
    return make_fix(f"write `{meant.only}`", edits, safe=meant.certain)
