"""The file of the pinned WireGuard keys: NAME.wireguard beside the spec, that of a lab in its folder."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from swarmctl.cli import console

if TYPE_CHECKING:
    from swarm_onboard.tunnel.keys import Keys

    from swarmctl.cli.spec_args import SpecFiles


@dataclass
class PinFile:
    """The file, and what it had when it was read."""

    path: Path
    text: str

    @property
    def keys(self) -> Keys:
        """The keys in it."""
        from swarm_onboard.tunnel.keys import Keys

        return Keys(self.text)

    def add(self, lines: str) -> None:
        """Joins lines of keys to the file."""
        from swarm_onboard.tunnel.keys import joined

        from swarmctl.cli import file_writes
        from swarmctl.spec import wireguard_keys

        text = joined(self.text, lines)
        if text != self.text:
            file_writes.replace(self.path, wireguard_keys.bytes_of(text))
            self.text = text


def place(spec: SpecFiles, swarm: str, lab: str) -> Path:
    """Returns where the file is; ``lab`` is empty for the real hosts."""
    from swarmctl.lab.paths import lab_paths
    from swarmctl.spec import wireguard_keys

    return lab_paths(lab).wireguard_keys if lab else spec.first.parent / wireguard_keys.path(swarm)


def read(spec: SpecFiles, swarm: str, lab: str) -> PinFile:
    """Reads the file, which need not be there; exits if it cannot be read."""
    path = place(spec, swarm, lab)
    try:
        return _read(path)
    except OSError as error:
        console.fail(f"{path} cannot be read: {error.strerror}", "what cannot be read is not replaced")


def expelled(spec: SpecFiles, swarm: str, lab: str) -> frozenset[str]:
    """Returns the hosts whose every key is retired; none if the file cannot be read."""
    with suppress(OSError):
        return _read(place(spec, swarm, lab)).keys.expelled
    return frozenset()


def _read(path: Path) -> PinFile:
    from swarmctl.spec import wireguard_keys

    with suppress(FileNotFoundError):
        return PinFile(path, wireguard_keys.text_of(path.read_bytes()))
    return PinFile(path, "")
