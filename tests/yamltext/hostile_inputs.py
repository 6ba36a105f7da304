"""Input that wants to hurt: what is hostile about each is its name. All are made here, none is stored."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from operator import mul

from swarmctl.yamltext.files import MAX_BYTES, MAX_CODEC_BYTES, MAX_NODES
from tests import ROOT

EXAMPLE = (ROOT / "examples/paper-leader/swarm.yaml").read_text("utf-8")
OWN_TYPE = b"""\
title: Snail
link: {kinds: [serial], baud: 115200}
kinematics:
  wheel_separation: 0.08
  wheel_speed_max: 0.25
  scales: [{speed_units_per_mps: 1000, metres_per_count: 0.0005}]
protocol: {kind: python, codec: SnailCodec, set_speed: {request: 16, reply: 8}}
firmware_dead_man: false
"""
HEAD = "version: 1\nname: big\nmode: leader\nleader: h\n"


def small() -> Iterator[tuple[str, bytes]]:
    """Broken encodings, characters nobody sees, numbers without end, aliases of themselves."""
    spec = EXAMPLE.encode()
    yield "empty", b""
    yield "nul", spec.replace(b"koala", b"ko\0ala", 1)
    yield "only-nul", b"\0" * 1000
    yield "invalid-utf8", spec.replace(b"koala", b"ko\xff\xfeala", 1)
    yield "truncated-utf8", spec + b"# \xe2\x82"
    yield "overlong-utf8", b"a: \xc0\x80\n"
    yield "lone-surrogate", b"a: \xed\xa0\x80\n"
    yield "escaped-surrogate", b'a: "\\ud800"\n'
    yield "bom", b"\xef\xbb\xbf" + spec
    yield "two-boms", b"\xef\xbb\xbf\xef\xbb\xbf" + spec
    yield "utf16", EXAMPLE.encode("utf-16")
    yield "utf16-be", EXAMPLE.encode("utf-16-be")
    yield "utf32", EXAMPLE.encode("utf-32")
    yield "crlf", spec.replace(b"\n", b"\r\n")
    yield "lone-cr", spec.replace(b"\n", b"\r")
    for code in (0x85, 0x2028, 0x2029, 0x200B, 0x202E, 0x2066, 0xFEFF, 0xFFFE, 0x7F, 0x1B, 0x0C):
        yield f"character-{code:x}", spec.replace(b"koala", f"ko{chr(code)}ala".encode(), 1)
        yield f"comment-{code:x}", spec + f"# {chr(code)}".encode()
        yield f"escape-{code:x}", spec.replace(b"type: koala", f'type: "ko\\u{code:04x}ala"'.encode(), 1)
    for digits in ("9" * 5000, "-" + "9" * 5000, "0." + "1" * 5000, "1e" + "9" * 5000, "0x" + "f" * 5000,
                   "0o" + "7" * 5000, "1:" * 5000 + "1", "1_" * 5000 + "1", "1e999", "-1e999", ".inf", ".nan",
                   "0b" + "1" * 5000, "0" * 5000):  # fmt: skip
        yield f"number-{digits[:12]}", spec.replace(b"115200", digits.encode(), 1)
        yield f"key-{digits[:12]}", f"{digits}: {digits}\n".encode()
    yield "alias-of-itself", b"&a [*a]"
    yield "alias-as-key", b"&a {*a : *a}"
    yield "alias-of-nothing", b"a: *nothing\n"
    yield "merge-of-itself", b"&a {<<: *a}"
    yield "two-documents", spec + b"---\n" + spec
    yield "directives", b"%YAML 9.9\n%TAG ! tag:x,2000:\n---\n!x {a: !y b}\n"
    yield "python-tag", b"!!python/object/apply:os.system [ls]\n"
    yield "include-device", b"include: [/dev/zero, /dev/stdin, /proc/self/mem]\n" + spec
    yield "include-itself", b"include: [swarm.yaml, ./swarm.yaml, ../swarm.yaml]\n" + spec
    yield (
        "include-names",
        b'include: ["\\0", "", ~, "~", "a\\nb", {}, [], 1, "' + b"x" * 5000 + b'"]\n' + spec,
    )


def large() -> Iterator[tuple[str, Callable[[], bytes]]]:
    """As much as the limits allow, and more: each is to be refused, or read, within the same two seconds.

    A function makes the content: together they are too much to keep.
    """
    for name, piece in {
        "flow": b"[", "block": b"- ", "keys": b"? ", "mappings": b"{a: ", "lines": b"[\n", "tags": b"!x [",
        "anchors": b"&a [", "quotes": b'["]",',
    }.items():  # fmt: skip
        yield f"deep-{name}", partial(mul, piece, 10_000)
    yield "deep-indented", lambda: b"".join(b" " * depth + b"a:\n" for depth in range(3_000))
    yield "deep-dashes", lambda: b"\n".join(b" " * depth + b"-" for depth in range(3_000))
    layers = [f"b{n}: &b{n} [{', '.join([f'*b{n - 1}'] * 9)}]\n" for n in range(1, 40)]
    yield "alias-bomb", ("b0: &b0 [x, x]\n" + "".join(layers)).encode
    pairs = [f"b{n}: &b{n} {{p: *b{n - 1}, q: *b{n - 1}}}\n" for n in range(1, 60)]
    yield "alias-bomb-of-mappings", ("b0: &b0 {p: x}\n" + "".join(pairs)).encode
    yield "aliases", lambda: b"a: &a x\nb: [" + b"*a," * (MAX_BYTES // 3 - 10) + b"]\n"
    yield "aliases-allowed", lambda: b"a: &a [x]\nb: [" + b"*a," * 99_000 + b"]\n"
    yield "anchors", lambda: b"[" + b"".join(b"&a%d x," % n for n in range(MAX_NODES - 10)) + b"]"
    yield "nodes", lambda: b"[" + b"a," * (MAX_BYTES // 2 - 10) + b"]"
    yield "nodes-allowed", lambda: b"[" + b"a," * (MAX_NODES - 10) + b"]"
    yield "empty-keys", lambda: b"{" + b"a," * (MAX_NODES // 2 - 10) + b"}"
    yield "lists", lambda: b"[" + b"[]," * (MAX_NODES - 10) + b"]"
    yield "mappings", lambda: b"[" + b"{}," * (MAX_NODES - 10) + b"]"
    yield "same-key", lambda: b"a: 1\n" * (MAX_NODES // 2 - 10)
    yield "pairs-of-keys", lambda: b"".join(b"k%d: 1\nk%d: 1\n" % (n, n) for n in range(MAX_NODES // 4 - 10))
    yield "traps", lambda: b"a: [" + b"012," * (MAX_NODES - 10) + b"]"
    yield "base-60", lambda: b"a: [" + b"10:00:52:14:33:11," * (MAX_NODES - 10) + b"]"
    yield "one-scalar", lambda: b"a: " + b"x" * (MAX_BYTES - 10)
    yield "one-wide-scalar", lambda: b"a: " + "\U0001f916".encode() * (MAX_BYTES // 4 - 10)
    yield "one-quote", lambda: b'a: "' + b"\\x41" * (MAX_BYTES // 4 - 10) + b'"'
    yield "one-comment", lambda: b"#" * (MAX_BYTES - 10)
    yield "one-number", lambda: b"a: " + b"1" * (MAX_BYTES - 10)
    yield "blank-lines", lambda: b"\n" * (MAX_BYTES - 10)
    yield "blanks", lambda: b" " * (MAX_BYTES - 10)
    yield "too-large", lambda: b"a" * (MAX_BYTES + 1)
    yield "nothing-but-nul", lambda: b"\0" * (MAX_BYTES - 10)
    yield "nul-late", lambda: b"\n" * (MAX_BYTES - 10) + b"\0"
    yield "no-utf8", lambda: b"\xff" * (MAX_BYTES - 10)
    yield "line-separators", lambda: "a: \u2028\n".encode() * 500_000
    mark = b"# swarmctl: ignore "
    yield "ignores", lambda: EXAMPLE.encode() + (mark + b"SET001 because\n") * 100_000
    yield (
        "unknown-ignores",
        lambda: EXAMPLE.encode() + b"".join(mark + b"Z%d x\n" % n for n in range(130_000)),
    )
    line = "{version: 1, hosts: {" + "".join(f"\u5b57{n}: {{q: 1}}, " for n in range(40_000)) + "}}"
    yield "one-wide-line-of-mistakes", line.encode
    robots = MAX_NODES // 6 - 100
    head = HEAD.encode() + b"hosts: {h: {address: 10.0.0.1}}\nrobots:\n"
    yield "wrong-robots", lambda: head + b"".join(b"  R%d: {a: 1, b: 2}\n" % n for n in range(robots))
    yield "empty-robots", lambda: head + b"".join(b"  r%d: {}\n" % n for n in range(MAX_NODES // 2 - 100))
    yield (
        "unknown-hosts",
        lambda: head + b"".join(b"  r%d: {type: koala, host: x}\n" % n for n in range(robots)),
    )
    yield (
        "unknown-types",
        lambda: head + b"".join(b"  r%d: {type: kola, host: h}\n" % n for n in range(robots)),
    )
    yield (
        "robots-without-lines",
        lambda: head + b"".join(b"  r%d: {type: koala, host: h}\n" % n for n in range(robots)),
    )
    yield (
        "late-mistakes",
        lambda: (
            head
            + b"".join(b"  r%d: {type: koala, host: h}\n" % n for n in range(100))
            + b"".join(b"  R%d: {a: 1, b: 2}\n" % n for n in range(robots - 200))
        ),
    )
    yield (
        "unknown-keys",
        lambda: HEAD.encode() + b"".join(b"k%d: 1\n" % n for n in range(MAX_NODES // 2 - 100)),
    )


def trees() -> Mapping[str, Mapping[str, bytes]]:
    """Specs of several files, by name."""
    spec = EXAMPLE.encode()
    chain = {f"f{n}.yaml": b"include: f%d.yaml\n" % (n + 1) for n in range(1_000)}
    wide = {f"f{n}.yaml": b"programs: {}\n" for n in range(1_200)}
    names = ", ".join(wide).encode()
    codecs = {
        "codec-large": b"a\n" * 1_500_000,
        "codec-small-statements": b"a;" * (MAX_CODEC_BYTES // 2),
        "codec-strings": b"f'" + b"{a}" * (MAX_CODEC_BYTES // 3 - 1) + b"'",
        "codec-calls": b"a" + b"()" * (MAX_CODEC_BYTES // 2 - 1),
        "codec-classes": b"".join(b"class C%d:0\n" % n for n in range(4_500)),
        "codec-one-line": b"(" * (MAX_CODEC_BYTES - 1),
    }
    beside = {"swarm.yaml": spec, "robots/snail.yaml": OWN_TYPE}
    snails = {f"robots/t{n}.yaml": OWN_TYPE for n in range(60)}
    strings = {f"robots/t{n}.py": codecs["codec-strings"] for n in range(60)}
    return {
        "types-large": {"swarm.yaml": spec, **{f"robots/t{n}.yaml": b"a: b\n" * 800_000 for n in range(5)}},
        "types-wrong": {"swarm.yaml": spec, **{f"robots/t{n}.yaml": b"a: 1\n" * 200 for n in range(990)}},
        "types-unread": {"swarm.yaml": spec, **{f"robots/t{n}.yml": b"" for n in range(5_000)}},
        "codecs-many": {"swarm.yaml": spec, **snails, **strings},
        **{name: {**beside, "robots/snail.py": codec} for name, codec in codecs.items()},
        "include-chain": {"swarm.yaml": b"include: f0.yaml\n" + spec, **chain},
        "include-many": {"swarm.yaml": b"include: [" + names + b"]\n" + spec, **wide},
        "include-one-often": {
            "swarm.yaml": b"include: [" + b"a.yaml, " * 50_000 + b"]\n",
            "a.yaml": b"a: 1\n",
        },
        "include-nothing-often": {"swarm.yaml": b"include: [" + b"b.yaml, " * 50_000 + b"]\n"},
    }
