"""Verbs whose modules are imported when they run: ``--help`` lists them without importing one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import import_module
from inspect import getdoc
from keyword import iskeyword
from typing import Any, ClassVar

import typer
from typer.core import TyperCommand, TyperGroup, TyperOption

from swarmctl.cli import exit_codes, spec_args

_BESIDE_NAMES = 6  # columns: the indentation, and the gap behind the names


class Verb(TyperCommand):
    """A verb as the list of verbs and shell completion show it: a name and the first sentence of its help.

    Args:
        name: the function in the verb's module, or the ``typer.Typer`` with the verbs below this one; a word
            of Python has a ``_`` behind it there.
        help: the first sentence of the function's docstring, or of the ``help`` of the ``typer.Typer``.
        codes: its own exit codes, beside those of every verb.
        example: a command line that does something useful, without ``swarmctl``.
        module: the module in ``swarmctl.cli.verbs``, if it is not called as the verb.
    """

    def __init__(
        self, name: str, help: str, *codes: int, example: str, module: str = "",  # noqa: A002
    ) -> None:  # fmt: skip
        super().__init__(name, help=help)
        self._name, self._codes = name, codes
        self.example = example
        self._function = f"{name}_" if iskeyword(name) else name
        self._module = module or self._function

    def load(self) -> Any:
        """Imports the module; returns the command that parses the verb's arguments and runs it."""
        found = getattr(import_module(f"swarmctl.cli.verbs.{self._module}"), self._function)
        home = typer.Typer(rich_markup_mode=None)
        text = found.info.help if isinstance(found, typer.Typer) else getdoc(found)
        help_text = f"{text}\n\nExample: swarmctl {self.example}"
        if isinstance(found, typer.Typer):
            home.add_typer(found, name=self._name, cls=_Group, help=help_text)
        else:
            home.command(self._name, help=help_text, epilog=exit_codes.epilog(*self._codes))(found)
        return _with_usual_spec(typer.main.get_group(home).commands[self._name])


class _Option(TyperOption):
    """An option that is converted if it is given: typer imports pydantic to convert even None."""

    def process_value(self, ctx: Any, value: Any) -> Any:
        return None if value is None else super().process_value(ctx, value)


class _BesideSpec(TyperCommand):
    """A verb of a spec and of something in it, whose SPEC may be left out in the folder of ``swarm.yaml``."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Inserts SPEC if the first argument is not a file."""
        first = self.make_parser(ctx).parse_args(list(args))[0].get("spec")
        left_out = isinstance(first, str) and not spec_args.is_spec(first) and spec_args.usual() is not None
        return super().parse_args(ctx, [spec_args.USUAL, *args] if left_out else args)

    def get_params(self, ctx: Any) -> list[Any]:
        """While SPEC may still be left out, the shell offers what follows it, too."""
        params: list[Any] = super().get_params(ctx)
        spec, following = [one for one in params if one.param_type_name == "argument"][:2]
        if ctx.resilient_parsing and spec_args.usual() is not None:
            spec.shell_complete = following.shell_complete
        return params


def _with_usual_spec(verb: Any) -> Any:
    for one in getattr(verb, "commands", {}).values():
        _with_usual_spec(one)
    if not hasattr(verb, "commands"):
        words = [param.name for param in verb.params if param.param_type_name == "argument"]
        if words[:1] == ["spec"] and len(words) > 1:
            verb.__class__ = _BesideSpec
    return verb


class _Group(TyperGroup):
    """A command with verbs below it."""

    def get_params(self, ctx: Any) -> list[Any]:
        """The options before the verb; typer adds those of completion and help after the command is made."""
        options = super().get_params(ctx)
        for option in options:
            option.__class__ = _Option
        return options


class LazyVerbs(_Group):
    """The command ``swarmctl``. A subclass names its verbs, and the groups of them in ``--help``."""

    verbs: ClassVar[Sequence[Verb]]
    groups: ClassVar[Mapping[str, Sequence[Verb]]]

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes | {"commands": self.verbs})

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Writes a section for each group of verbs."""
        longest = max(len(verb.name or "") for verb in self.verbs)
        width = formatter.width - longest - _BESIDE_NAMES
        for title, verbs in self.groups.items():
            with formatter.section(title):
                rows = [(f"{verb.name:{longest}}", verb.get_short_help_str(width)) for verb in verbs]
                formatter.write_dl(rows)

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[str | None, Any, list[str]]:
        """Imports the verb that ``args`` begin with; returns its name, its command and its arguments."""
        name, verb, rest = super().resolve_command(ctx, args)
        return name, verb.load() if isinstance(verb, Verb) else verb, rest

    def invoke(self, ctx: Any) -> Any:
        """Runs the verb. Raises ``typer.Abort`` for Ctrl-C, of which typer would only leave an exit code."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            raise typer.Abort from None
