"""Secrets in or next to the spec, and public addresses. No message repeats a secret."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

from swarmctl.diagnostics import Diagnostic, Span
from swarmctl.linter.context import RuleContext, rule
from swarmctl.render.security_level import level_of
from swarmctl.swarm import addresses
from swarmctl.swarm.addresses import Kind, kind
from swarmctl.swarm.bridges import bridges_of
from swarmctl.swarm.flow import peers_of
from swarmctl.swarm.flows import ros_flows
from swarmctl.swarm.wireguard_routes import Networks
from swarmctl.yamltext.source import Loc

_WORDS = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|[0-9]+")
_PASSWORDS = {"password", "passwd", "passphrase", "psk"}
_SECRETS = _PASSWORDS | {"secret", "token", "apikey"}
_PAIRS = {
    ("api", "key"),
    ("access", "key"),
    ("private", "key"),
    ("auth", "key"),
    ("bluetooth", "pin"),
    ("pin", "code"),
}
_OTHER = "10.200.0.0/16"
_UNFIT = (Kind.UNSPECIFIED, Kind.LOOPBACK, Kind.GROUP)
# Words that turn a secret's name into a name about it: its path, its length.
_ABOUT = {"file", "path", "folder", "name", "topic", "id", "length", "timeout", "type", "url", "uri"}
# Packages of ROS 1 that join masters: fkie's under its three names, rocon's, and a relay.
_MULTIMASTERS = {
    *("fkie_master_discovery", "fkie_master_sync", "master_discovery_fkie", "master_sync_fkie"),
    *("fkie_mas_discovery", "fkie_mas_sync", "rocon_gateway", "rocon_hub", "foreign_relay"),
}
# A word with an option or a variable and its value: --password=x, password:=x, PASSWORD=x.
_ASSIGNED = re.compile(r"(-{0,2}([A-Za-z][\w./-]*)):?=(.*)", re.DOTALL)
_SWITCHES = {"ask", "disable", "enable", "no", "prompt", "require", "show", "skip", "use", "without"}
_REFERENCE = re.compile(r"[/~$<{].*|")  # a file, a variable, a placeholder, or empty

# The forms of secrets: prefixes, pattern, and name.
_FORMS = (
    (("-----BEGIN ",), re.compile(r"-----BEGIN [A-Z ]*PRIVATE KEY-----.*"), "a private key"),
    (("AKIA", "ASIA"), re.compile(r"A[KS]IA[0-9A-Z]{16}\b"), "an AWS access key"),
    (("ghp_", "gho_", "ghu_", "ghs_", "ghr_"), re.compile(r"gh[pousr]_[A-Za-z0-9]{36,}"), "a GitHub token"),
    (("github_pat_",), re.compile(r"github_pat_[A-Za-z0-9_]{22,}"), "a GitHub token"),
    (("glpat-",), re.compile(r"glpat-[A-Za-z0-9_-]{20,}"), "a GitLab token"),
    (
        ("uthorization:",),
        re.compile(r"[Aa]uthorization: *(?:Bearer|Basic|Token) +([^\s'\"$<{][^\s'\"]{7,})"),
        "a header with a password or a token",
    ),
    (("xox",), re.compile(r"xox[abprs]-[A-Za-z0-9-]{10,}"), "a Slack token"),
    # not udp://0.0.0.0:14540@host, an address of MAVLink with a port
    (
        ("://",),
        re.compile(r"://((?![\d.]+:\d+@)[^\s/:@'\"]+:[^\s/@'\"$<{][^\s/@'\"]*)@"),
        "a URL with a password",
    ),
)
_REMEDY = (
    "keep it in a file on the host, and give the program the path",
    "and change the secret, since it stays in the history of this file",
)


@rule("SEC001", "SEC002")
def secrets(context: RuleContext) -> Iterator[Diagnostic]:
    """A secret, recognised by the name of its key or by its form anywhere in the text."""
    named = [_named_secret(context, loc, key) for loc, key in _secret_places(context)]
    yield from named
    known = [one.span for one in named if one.span is not None]
    for file, text in context.document.source.texts.items():
        for span, what in _look_alikes(file, text):
            if not any(one.file == file and _holds(one, span) for one in known):
                yield Diagnostic(
                    "SEC002",
                    f"{what} in plain text",
                    span,
                    label="visible to everyone who has the file",
                    help=_REMEDY,
                    secret=True,
                )


def _secret_places(context: RuleContext) -> Iterator[tuple[Loc, str]]:
    """Yields the place of each secret of a program, and the name of its key or option."""
    for name, program in context.spec.programs.items():
        for group in ("params", "environment", "args"):
            yield from _named_in(getattr(program, group), "programs", name, group)
        container = program.container.command if program.container is not None else ()
        for loc, words in (
            (("args",), program.words),
            (("command",), program.command or ()),
            (("container", "command"), container),
        ):
            yield from ((("programs", name, *loc, index), option) for index, option in _secret_words(words))


def _named_in(value: object, *loc: str | int) -> Iterator[tuple[Loc, str]]:
    """Yields each value below ``value`` whose key is that of a secret."""
    for key, one in value.items() if isinstance(value, Mapping) else ():
        if isinstance(one, Mapping):
            yield from _named_in(one, *loc, key)
        elif is_secret(key, one):
            yield (*loc, key), key


def _secret_words(words: Sequence[str]) -> Iterator[tuple[int, str]]:
    """Yields which words of a command line hold a secret, each with its option."""
    for index, word in enumerate(words):
        before = words[index - 1] if index else ""
        if found := _ASSIGNED.fullmatch(word):
            if is_secret(found[2], found[3].strip("'\"")):
                yield index, found[1]
        elif before.startswith("-") and not word.startswith(("-", "@")):
            has_value = _SWITCHES.isdisjoint(one.lower() for one in _WORDS.findall(before))
            if has_value and "=" not in before and is_secret(before, word):
                yield index, before


def is_secret(key: str, value: object) -> bool:
    """True if the key's name and the value indicate a secret; paths and variables do not."""
    words = [word.lower() for word in _WORDS.findall(key)]
    if not words or isinstance(value, bool) or words[-1] in _ABOUT:
        return False
    if not isinstance(value, str):
        return not _PASSWORDS.isdisjoint(words)
    named = not _SECRETS.isdisjoint(words) or not _PAIRS.isdisjoint(pairwise(words))
    return named and not _REFERENCE.fullmatch(value)


def _named_secret(context: RuleContext, loc: Loc, key: str) -> Diagnostic:
    return Diagnostic(
        "SEC001",
        f"`{key}` of program `{loc[1]}` is a secret in plain text",
        context.span(*loc),
        label="visible to everyone who has the file",
        help=_REMEDY,
        secret=True,
    )


def _look_alikes(file: str, text: str) -> Iterator[tuple[Span, str]]:
    for heads, form, what in _FORMS:
        if any(head in text for head in heads):
            for match in form.finditer(text):
                first, end = match.span(match.lastindex or 0)
                line, start = text.count("\n", 0, first) + 1, first - text.rfind("\n", 0, first)
                yield Span(file, line, start, line, start + end - first), what


def _holds(outer: Span, inner: Span) -> bool:
    begins = (outer.line, outer.column) <= (inner.line, inner.column)
    return begins and (inner.end_line, inner.end_column) <= (outer.end_line, outer.end_column)


@rule("SEC003")
def keys_beside(context: RuleContext) -> Iterator[Diagnostic]:
    """A private key in the spec's folder, which is usually a repository."""
    for name in context.document.private_keys:
        yield Diagnostic(
            "SEC003",
            f"the file `{name}` in the spec's folder is a private key",
            help=(
                "keep it in ~/.ssh or in an SSH agent; swarmctl uses both",
                "if it was ever committed, create a new one and remove the old one from every host",
            ),
        )


@rule("SEC004")
def public_addresses(context: RuleContext) -> Iterator[Diagnostic]:
    """A public address of a host that runs ROS, which has no authentication."""
    if not context.has_masters and not context.can("domains"):
        return
    public = [
        name
        for name, ip in context.addresses.items()
        if ip is not None and name in context.home and kind(ip) is Kind.ORDINARY and ip.is_global
    ]
    if public:
        others = len(public) - 1
        verb = f"and {others} more have public addresses" if others else "has a public address"
        yield Diagnostic(
            "SEC004",
            f"host `{public[0]}` {verb}, and ROS has no authentication",
            context.span("hosts", public[0], "address"),
            label="not a private address",
            help=(
                "put the swarm behind its own router, with addresses such as 192.168.77.10",
                "if a firewall blocks incoming traffic, ignore this with that reason",
            ),
        )


@rule("SEC005", "SEC006")
def unfilterable_hosts(context: RuleContext) -> Iterator[Diagnostic]:
    """Hosts whose packets `security: filtered` cannot distinguish from those of others."""
    filtered = {host for island in context.islands if island.filtered for host in island.hosts}
    if not filtered:
        return
    all_peers = peers_of(ros_flows(context.spec, context.islands, bridges_of(context)))
    peers = {
        host: [one for one in context.spec.hosts if one in others and not filtered.isdisjoint((one, host))]
        for host, others in all_peers.items()
    }
    for host in context.spec.hosts:
        if (host in filtered or peers.get(host)) and context.addresses[host] is None:
            yield Diagnostic(
                "SEC005",
                f"host `{host}` has no IP address, and {_level(context)} accepts packets by IP address",
                context.span("hosts", host, "address"),
                label="a name",
                help=("write its IP address, and reserve it for the host in the DHCP server of the network",),
            )
    if context.networks:
        yield from _apart(context, peers)


def _apart(context: RuleContext, peers: Mapping[str, Sequence[str]]) -> Iterator[Diagnostic]:
    """Hosts without a network in common that has both addresses; of each pair the one that has more such.

    In a sealed swarm they may have a third host in common; NET001 reports those that do not reach their hub.
    """
    homes = [(host, island.hub) for island in context.islands for host in island.hosts]
    alone = {host for host, hub in homes if not context.reaches(host, hub)}
    places = {host: _networks_by_address(context, host) for host in peers if context.addresses[host]}
    apart = {
        host: [
            one
            for one in peers[host]
            if one in places
            and places[one].isdisjoint(own)
            and (alone.isdisjoint((host, one)) or context.reaches(host, one))
        ]
        for host, own in places.items()
    }
    if context.spec.has_wireguard:
        networks = Networks(context)
        apart = {
            host: [one for one in others if not (networks.joins(host, one) or networks.relay(host, one))]
            for host, others in apart.items()
        }
    reported: set[str] = set()
    for host in sorted(apart, key=lambda one: -len(apart[one])):
        others = [one for one in apart[host] if one not in reported]
        if not others:
            continue
        reported.add(host)
        more = f" and {len(others) - 1} more" if len(others) > 1 else ""
        yield Diagnostic(
            "SEC006",
            f"no network has the addresses of both `{host}` and `{others[0]}`{more}: "
            f"{_level(context)} drops what they send each other",
            context.span("hosts", host, "address"),
            label=f"`{others[0]}` sends from another address, or a router translates it",
            help=("give both addresses in one network of `links`",),
        )


def _level(context: RuleContext) -> str:
    """The level that filters: that of the swarm, or of its first island with one."""
    levels = (context.spec.security, *(one.security for one in context.islands))
    return f"`security: {next(one for one in levels if level_of(one).filters)}`"


def _networks_by_address(context: RuleContext, host: str) -> frozenset[int]:
    """The networks of a host in whose subnets its address is."""
    ip = context.addresses[host]
    subnets = ((index, context.subnets[index]) for index, _ in context.networks_of[host])
    return frozenset(index for index, subnet in subnets if ip and subnet is not None and ip in subnet)


@rule("SEC007")
def foreign_multimasters(context: RuleContext) -> Iterator[Diagnostic]:
    """A program that joins masters by itself, which `security: filtered` keeps from those of others."""
    filtered = {host for island in context.islands if island.filtered for host in island.hosts}
    for name, program in context.spec.programs.items():
        if program.package in _MULTIMASTERS and program.host in filtered:
            yield Diagnostic(
                "SEC007",
                f"program `{name}` is of the multimaster `{program.package}`, and `security: filtered` lets "
                "no other master reach it",
                context.span("programs", name, "package"),
                label="the graph has no flow for it",
                help=(
                    "remove the program, and list under `multimaster.topics` what is to cross",
                    "or write `security: off`, for the swarm or for the island",
                ),
            )


@rule("SEC008")
def robots_without_keys(context: RuleContext) -> Iterator[Diagnostic]:
    """A robot that runs nodes itself, to which no key can be brought."""
    if not context.spec.ros.sros2:
        return
    for name, driver in context.ros_drivers.items():
        if driver.peer:
            yield Diagnostic(
                "SEC008",
                f"robot `{name}` runs nodes of ROS 2 itself, and `sros2` lets no node without a key join",
                context.span("robots", name, "type"),
                label="swarmctl brings no files to the robot itself",
                help=("remove `sros2`", "or leave the robot out of this swarm"),
            )


@rule("SEC009")
def unsealable(context: RuleContext) -> Iterator[Diagnostic]:
    """What `security: sealed` cannot carry between hosts: multicast, and nodes that run elsewhere."""
    if not context.spec.has_wireguard:
        return
    for name, island in context.spec.islands.items():
        if island.security is not None:
            yield Diagnostic(
                "SEC009",
                f"island `{name}` has a `security` of its own, and the swarm is sealed",
                context.span("islands", name, "security"),
                label="WireGuard is between all hosts of a swarm",
                help=("remove it",),
            )
    if any(one.discovery.method == "multicast" for one in context.islands if not one.has_master):
        yield Diagnostic(
            "SEC009",
            "nodes look for others by multicast, which WireGuard does not carry",
            context.span("ros", "discovery"),
            label="no node would find another host's",
            help=("write `discovery: peers`, or remove it",),
        )
    for name, driver in context.ros_drivers.items():
        if driver.peer:
            yield Diagnostic(
                "SEC009",
                f"robot `{name}` runs nodes of ROS 2 itself, and has no WireGuard",
                context.span("robots", name, "type"),
                label="swarmctl brings no files to the robot itself",
                help=("write `security: filtered`", "or leave the robot out of this swarm"),
            )


@rule("SEC010", "SEC011")
def overlays(context: RuleContext) -> Iterator[Diagnostic]:
    """A network of WireGuard with addresses that something else has."""
    spec = context.spec
    if not spec.has_wireguard:
        if spec.overlay is not None:
            yield Diagnostic(
                "SEC010",
                "`overlay` is the network of WireGuard, which only `security: sealed` has",
                context.span("overlay"),
                label="has no effect",
                help=("remove it, or write `security: sealed`",),
            )
        return
    network = addresses.wireguard_network(spec)
    choose = (f"write another network, such as `overlay: {_OTHER}`",)
    place = context.span("overlay") if spec.overlay is not None else context.span("security")
    unfit = next((one for ip in (network[0], network[-1]) if (one := kind(ip)) in _UNFIT), None)
    if unfit is not None:
        what = f"hosts cannot have addresses in {network}, the network of WireGuard"
        yield Diagnostic("SEC010", what, place, label=unfit.value, help=choose)
    elif network.is_global:
        yield Diagnostic(
            "SEC011",
            f"{network}, the network of WireGuard, has public addresses",
            place,
            label="no host reaches those of the Internet with these addresses",
            help=choose,
        )
    taken = {name: ip for name, ip in context.addresses.items() if ip is not None and ip in network}
    used = next((one for one in context.subnets.values() if one is not None and one.overlaps(network)), None)
    if taken or used is not None:
        other = f"host `{min(taken)}` has an address in it" if taken else f"a network of `links` is {used}"
        yield Diagnostic("SEC010", f"{network} is the network of WireGuard, and {other}", place, help=choose)
    by_address: dict[object, str] = {}
    for name in context.home:
        first = by_address.setdefault(addresses.wireguard_address(spec, name), name)
        if first != name:
            what = f"hosts `{first}` and `{name}` would have the same address in {network}"
            yield Diagnostic("SEC010", what, place, help=choose)
