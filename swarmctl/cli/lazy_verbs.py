"""Verbs whose modules are imported when they run: ``--help`` lists them without importing one."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from keyword import iskeyword
from typing import Any, ClassVar

import typer
from typer.core import TyperCommand, TyperGroup, TyperOption

from swarmctl.cli import exit_codes


class Verb(TyperCommand):
    """A verb as the list of verbs and shell completion show it: a name and the first sentence of its help.

    Args:
        name: the function in the verb's module, or the ``typer.Typer`` with the verbs below this one; a word
            of Python has a ``_`` behind it there.
        help: the first sentence of the function's docstring, or of the ``help`` of the ``typer.Typer``.
        codes: its own exit codes, beside those of every verb.
        module: the module in ``swarmctl.cli.verbs``, if it is not called as the verb.
    """

    def __init__(self, name: str, help: str, *codes: int, module: str = "") -> None:  # noqa: A002
        super().__init__(name, help=help)
        self._name, self._codes = name, codes
        self._function = f"{name}_" if iskeyword(name) else name
        self._module = module or self._function

    def load(self) -> Any:
        """Imports the module; returns the command that parses the verb's arguments and runs it."""
        found = getattr(import_module(f"swarmctl.cli.verbs.{self._module}"), self._function)
        home = typer.Typer(rich_markup_mode=None)
        if isinstance(found, typer.Typer):
            home.add_typer(found, name=self._name, cls=_Group)
        else:
            home.command(self._name, epilog=exit_codes.epilog(*self._codes))(found)
        return typer.main.get_group(home).commands[self._name]


class _Option(TyperOption):
    """An option that is converted if it is given: typer imports pydantic to convert even None."""

    def process_value(self, ctx: Any, value: Any) -> Any:
        return None if value is None else super().process_value(ctx, value)


class _Group(TyperGroup):
    """A command with verbs below it."""

    def get_params(self, ctx: Any) -> list[Any]:
        """The options before the verb; typer adds those of completion and help after the command is made."""
        options = super().get_params(ctx)
        for option in options:
            option.__class__ = _Option
        return options


class LazyVerbs(_Group):
    """The command ``swarmctl``. A subclass names its verbs."""

    verbs: ClassVar[Sequence[Verb]]

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes | {"commands": self.verbs})

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[str | None, Any, list[str]]:
        """Imports the verb that ``args`` begin with; returns its name, its command and its arguments."""
        name, verb, rest = super().resolve_command(ctx, args)
        return name, verb.load() if isinstance(verb, Verb) else verb, rest
