"""``--install-completion``: shows the files that it would change, and changes them after a yes."""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

import typer

from swarmctl.cli import console, file_writes
from swarmctl.cli.file_writes import Change

_SCRIPTS = {  # where each shell looks for the script, in the home folder
    "bash": ".bash_completions/swarmctl.sh",
    "zsh": ".zfunc/_swarmctl",
    "fish": ".config/fish/completions/swarmctl.fish",
}
_LINES = {  # in ~/.bashrc and ~/.zshrc; fish needs none
    "bash": "source '{script}'",
    "zsh": "fpath+=~/.zfunc; autoload -Uz compinit; compinit",
}


def ask_and_install(context: Any, _: Any, wanted: Any) -> Any:
    """The callback of the option."""
    if not wanted or context.resilient_parsing:
        return wanted
    shell, changes = _changes()
    for change in changes:
        lines = len(change.after.splitlines())
        text = file_writes.difference(change) if change.before else f"new file {change.file}: {lines} lines"
        print(text.encode(errors="replace").decode())
    if not changes:
        console.out().print(f"completion for {shell} is installed already")
        raise typer.Exit
    if not (sys.stdin.isatty() and typer.confirm("Make these changes?", err=True)):
        console.fail(
            "nothing was changed",
            "answer `y` on a terminal, or write the output of `swarmctl --show-completion` where you want it",
        )
    for change in changes:
        Path(change.file).parent.mkdir(parents=True, exist_ok=True)
        file_writes.replace(Path(change.file), change.after.encode(errors="surrogateescape"))
    console.out().print(f"completion for {shell} is installed; it works in new terminals")
    raise typer.Exit


def _changes() -> tuple[str, list[Change]]:
    """The shell, and what installing completion for it changes; exits for a shell without completion."""
    shell = _shell()
    if shell not in _SCRIPTS:
        console.fail(
            f"there is no completion for {shell or 'this shell'}", f"it is for {', '.join(_SCRIPTS)}"
        )
    home = Path.home()
    script = home / _SCRIPTS[shell]
    wanted = {script: _script(shell)}
    if shell in _LINES:
        settings, line = home / f".{shell}rc", _LINES[shell].format(script=script)
        text = _text(settings)
        if line not in text:
            begun = text if text.endswith("\n") or not text else f"{text}\n"
            wanted[settings] = f"{begun}{line}\n"
    changes = [_change(path, after) for path, after in sorted(wanted.items())]
    return shell, [change for change in changes if change.before != change.after]


def _shell() -> str:
    """The name of the shell that swarmctl was started from, else that of ``$SHELL``."""
    parent = os.getppid()
    with suppress(OSError):  # no /proc, or the process of somebody else
        while parent > 1:
            name = Path(f"/proc/{parent}/comm").read_text("utf-8").strip()
            if name in _SCRIPTS:
                return name
            parent = int(Path(f"/proc/{parent}/stat").read_text("utf-8").rpartition(")")[2].split()[1])
    return Path(os.environ.get("SHELL", "")).name


def _script(shell: str) -> str:
    """The script that swarmctl itself prints for a shell, when the shell's variable is set."""
    environment = {**os.environ, "_SWARMCTL_COMPLETE": f"source_{shell}"}
    command = [sys.executable, "-m", "swarmctl"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return f"{done.stdout.strip()}\n"


def _text(path: Path) -> str:
    return path.read_text("utf-8", "surrogateescape") if path.is_file() else ""


def _change(path: Path, after: str) -> Change:
    text = _text(path)
    return Change(text.encode(errors="surrogateescape"), str(path), text, after)
