"""Reads the log of the program ``ssh`` (``LogLevel DEBUG1``): how far a login has come, and why it failed.

A host's own texts are no lines of their own there: ``ssh`` escapes them, and its banner goes elsewhere.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from enum import Enum

from swarmctl.remote import ssh_errors as errors
from swarmctl.remote.transport import HostError, Kind, Target

_KEPT = 400  # lines


class Stage(Enum):
    """What a login waits for."""

    CONNECT = "connect"
    BANNER = "banner"
    HANDSHAKE = "handshake"
    LOGIN = "login"
    TOUCH = "touch"  # a person at a security key
    DONE = "done"


# What the lines of OpenSSH 7 to 10 begin with, in the order of a login.
_STAGES = (
    ("debug1: Connecting to ", Stage.CONNECT),
    ("debug1: Executing proxy command", Stage.CONNECT),
    ("debug1: Connection established", Stage.BANNER),
    ("debug1: Remote protocol version", Stage.HANDSHAKE),
    ("debug1: SSH2_MSG_NEWKEYS received", Stage.LOGIN),
    ("debug1: Entering interactive session", Stage.DONE),
)
_SHOWN = re.compile(r"debug1: Server host key: (\S+ \S+)")
_OFFERED = re.compile(r"debug1: (?:Offering public key|Trying private key): (.+?)(?: (\S+) SHA256:\S+.*)?$")
_ACCEPTED = re.compile(r"debug1: Server accepts key: (.+?) \S+ SHA256:")
_PROVIDER = re.compile(r"debug1: provider (\S+): manufacturerID")
_TICKET = re.compile(
    r"(No Kerberos credentials .*|Ticket expired.*|Server .* not found in Kerberos database.*)"
)
_METHODS = re.compile(r".*: Permission denied \((.*)\)\.")
_NO_MATCH = re.compile(r"Unable to negotiate with .*: no matching .* found\. Their offer: (.*)")
_CONNECT = re.compile(r".*connect to .* port .*: (.*)")
_UNUSABLE = re.compile(r'Load key "(.*)": (.*)')
_NO_ADDRESS = "Could not resolve hostname "
_WAITED = ("onnection timed out during banner exchange", " timed out")
_NOT_SSH = ("banner line contains invalid", "Invalid SSH identification", "Protocol major versions")
_CLOSED = (
    "kex_exchange_identification",
    "ssh_exchange_identification",
    "banner exchange",
    "Connection closed by",
    "Connection reset by",
)
_CONFIGURATION = (" line ", "Bad owner or permissions on ")


@dataclass
class LoginLog:
    """What is known of a login so far."""

    stage: Stage = Stage.CONNECT
    shown: str = ""  # type and fingerprint of the host key
    offered: list[str] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)
    accepted: str = ""  # the key that the host would accept
    provider: str = ""  # the library of a PKCS#11 token
    lines: list[str] = field(default_factory=list)  # those that are no debug lines

    def add(self, line: str) -> None:
        """Takes the next line."""
        for start, stage in _STAGES:
            if line.startswith(start):
                self.stage = stage
        if found := _SHOWN.match(line):
            self.shown = found[1]
        elif found := _OFFERED.match(line):
            self.offered.append(found[1])
            self.stage = Stage.TOUCH if (found[2] or "").endswith("-SK") else Stage.LOGIN
        elif line.startswith("no such identity: "):
            self.missing.append(line.removeprefix("no such identity: ").rpartition(": ")[0])
        elif found := _ACCEPTED.match(line):
            self.accepted = found[1]
        elif found := _PROVIDER.match(line):
            self.provider = found[1]
        elif not line.startswith("debug") and len(self.lines) < _KEPT:
            self.lines.append(line)

    def error(self, target: Target, printed: str, waited: float, *, late: bool) -> HostError:
        """Why the login failed. ``printed``: the last line of a proxy command; ``waited``: in s.

        ``late``: swarmctl has ended it since nothing came any more.
        """
        if late:
            return self._late(target, waited)
        text = "\n".join(self.lines)
        if "Host key verification failed" in text or "host key is revoked" in text.lower():
            return errors.wrong_host_key(target, self.shown, revoked="revoked" in text.lower())
        if found := _first(_NO_MATCH, self.lines):
            return errors.no_common_algorithm(target, found, program=True)
        if found := _first(_METHODS, self.lines):
            return self._rejected(target, found.split(","))
        if self.stage in (Stage.LOGIN, Stage.TOUCH):
            return errors.closed_login(target)
        return self._unreached(target, printed, waited)

    def _late(self, target: Target, waited: float) -> HostError:
        if self.stage is Stage.CONNECT:
            silent = f"no answer within {waited:.3g} s"
            return (
                errors.no_way_through_hop(target, silent) if target.jump else errors.no_answer(target, waited)
            )
        if self.stage is Stage.BANNER:
            return errors.no_banner(target)
        if self.stage is Stage.HANDSHAKE:
            return errors.stalled_handshake(target)
        if self.stage is Stage.TOUCH:
            return HostError(
                Kind.AUTH,
                f"nobody touched the security key within {waited:.3g} s to log in to {target.host}",
                "run the same command again, and touch it once it blinks",
            )
        return errors.silent_login(target, f"{waited:.3g} s passed")

    def _rejected(self, target: Target, methods: list[str]) -> HostError:
        if "publickey" not in methods:
            return errors.no_public_keys(target, methods)
        if unusable := next(filter(None, map(_UNUSABLE.match, self.lines)), None):
            return errors.unusable_key(*unusable.groups())
        if self._has("pin required"):
            return errors.locked_token(self.provider)
        if self.accepted:
            return errors.locked_key(self.accepted)
        tried = [name for name in self.offered if name not in self.missing]
        if tried:
            return errors.rejected(target, tried)
        if found := _first(_TICKET, self.lines):
            return errors.no_ticket(target, errors.quoted(found))
        return errors.missing_key(self.missing[0]) if self.missing else errors.no_private_key(target)

    def _unreached(self, target: Target, printed: str, waited: float) -> HostError:
        last = self.lines[-1] if self.lines else printed or "it ended without a word"
        if self._has(_NO_ADDRESS):
            return errors.unknown_name(target)
        if reason := _first(_CONNECT, self.lines):
            if reason == "Connection refused":
                return errors.nothing_listens(target)
            return (
                errors.no_answer(target, waited) if "timed out" in reason else errors.no_way(target, reason)
            )
        if self._has(*_WAITED):
            return errors.no_banner(target)
        if printed and self.stage is Stage.CONNECT:
            reason = errors.quoted(printed)
            return errors.no_way_through_hop(target, reason) if target.jump else errors.no_way(target, reason)
        if self._has(*_NOT_SSH):
            return errors.dropped(target, greeted=False)
        if self._has(*_CLOSED):
            return errors.dropped(target, greeted=self.stage is Stage.HANDSHAKE)
        if self._has(*_CONFIGURATION):
            return HostError(
                Kind.UNREACHABLE,
                f"{target.host}: ssh refuses its configuration: {errors.quoted(self.lines[0])}",
                "`ssh -G HOST` reports the same",
            )
        return errors.failed_handshake(target, errors.quoted(last))

    def _has(self, *parts: str) -> bool:
        return any(part in line for line in self.lines for part in parts)


def _first(pattern: re.Pattern[str], lines: list[str]) -> str:
    found = (match[1] for line in lines if (match := pattern.match(line)))
    return next(found, "")
