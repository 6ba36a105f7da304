"""Brings edits of hosts into the files of a spec: guesses where each value comes from, changes the text
there, renders the changed spec, and keeps the change if the file on the host is what came out.

Pure but for the texts that ``Reader`` reads. What cannot be brought home stays as it is, with the reason.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from swarmctl.adoption.changes import ABSENT, Change, EditedFile, beside, changes, overlaid
from swarmctl.adoption.places import Guess, guesses, source_of
from swarmctl.render.bundle import Bundle, File
from swarmctl.render.rendered_values import Key, Values, equal, same_meaning, values_of
from swarmctl.spec.load import Document
from swarmctl.yamltext import edits

Texts = Mapping[str, str]  # by file
#: Returns the document that a spec is with other texts of some of its files, and what each host gets; or why
#: there is none.
Reader = Callable[[Texts], "tuple[Document, Mapping[str, Bundle]] | str"]


@dataclass(frozen=True)
class Adopted:
    """An edit that is in the spec now, and its place there; ``what`` is empty for a file beside the spec."""

    host: str
    path: str
    what: str
    place: str


@dataclass(frozen=True)
class Refused:
    """An edit that stays on its host, and the reason."""

    host: str
    path: str
    what: str
    reason: str


@dataclass(frozen=True)
class Adoption:
    """The new texts of files, and what became of each edit."""

    texts: Texts
    adopted: tuple[Adopted, ...] = ()
    refused: tuple[Refused, ...] = ()


class ContradictionError(ValueError):
    """Two hosts have different edits of one value; the text names both."""


def adopt(read: Reader, files: Sequence[EditedFile], into: str = "", text: str = "") -> Adoption:
    """Returns how the files of a spec change so that it has what was edited on hosts.

    ``into``: the overlay to write, whose present text is ``text``; without it, each value is changed where
    it stands. Raises ``ContradictionError``, and ``ValueError`` if the spec itself has errors.
    """
    found = read({into: text} if into else {})
    if isinstance(found, str):
        raise ValueError(found)
    edited = {(one.host, one.path): one for one in files}
    work = _Work(read, *found, into, {into: text} if into else {}, edited)
    for file in sorted(files, key=lambda one: (one.host, one.path)):
        work.take(file)
    texts = {name: one for name, one in work.texts.items() if name != into or one != text}
    return Adoption(texts, tuple(work.adopted), tuple(work.refused))


@dataclass
class _Work:
    """The spec with the edits that were taken so far."""

    read: Reader
    document: Document
    bundles: Mapping[str, Bundle]
    into: str
    texts: dict[str, str]
    edited: Mapping[tuple[str, str], EditedFile]  # by host and path
    adopted: list[Adopted] = field(default_factory=list)
    refused: list[Refused] = field(default_factory=list)
    taken: list[Change] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.first = self.bundles

    def take(self, file: EditedFile) -> None:
        """Brings one file home, as far as that is possible."""
        rendered = _file(self.first, file.host, file.path)
        if reason := _unfit(file, rendered):
            self._refuse(file, "", reason)
        elif rendered is not None and (place := beside(self.document, rendered)):
            self._take_whole(file, rendered, place)
        elif rendered is not None:
            found = changes(file, rendered.content.decode("utf-8", "replace"))
            if isinstance(found, str):
                self._refuse(file, "", found)
                return
            for change in found:
                self._take_value(file, rendered, change)

    def _take_whole(self, file: EditedFile, rendered: File, place: str) -> None:
        """The file itself lies beside the spec: what was edited is its new text."""
        text = file.text or ""
        if self.texts.get(place, text) != text:
            other = next(one.host for one in self.adopted if one.place == place)
            raise ContradictionError(f"{other} and {file.host} have different edits of {place}")
        self.texts[place] = text
        if isinstance(found := self.read(self.texts), str):
            del self.texts[place]
            self._refuse(file, "", f"with it the spec has an error: {found}")
            return
        self.document, self.bundles = found
        self.adopted.append(Adopted(file.host, file.path, "", place))

    def _take_value(self, file: EditedFile, rendered: File, change: Change) -> None:
        if _has(self.bundles, change):  # by an edit of another file or host
            self.taken.append(change)
            self.adopted.append(Adopted(file.host, file.path, change.what, "the same place"))
            return
        reasons: list[str] = []
        values = values_of(rendered.path, rendered.content.decode("utf-8", "replace"))
        for guess in guesses(self.document, change, rendered.origin, values):
            written = self._written(guess)
            if written is None:
                continue
            texts, shared = written
            if isinstance(found := self.read(texts), str):
                reasons.append(shared or f"`{guess.text}: {_shown(guess.value)}` is not valid: {found}")
                continue
            if wrong := self._wrong(file, rendered, change, found[1]):
                reasons += [shared or f"`{guess.text}` {wrong}"] if _has(found[1], change) else []
                continue
            self._check_contradiction(change, found[1])
            self.document, self.bundles = found
            self.texts = dict(texts)
            self.taken.append(change)
            self.adopted.append(Adopted(file.host, file.path, change.what, self._place(guess)))
            return
        self._refuse(file, change.what, reasons[0] if reasons else _derived(self.document, rendered))

    def _place(self, guess: Guess) -> str:
        if self.into:
            return f"{guess.text} ({self.into})"
        span = source_of(self.document, guess).span(guess.loc)
        return f"{guess.text} ({span.file}:{span.line})"

    def _written(self, guess: Guess) -> tuple[dict[str, str], str] | None:
        """The texts with a guess in them; None if they cannot take it.

        If the text stands for several entries at once, what to do where not all of these are edited so, too.
        """
        if self.into and not guess.type_name and guess.value is not ABSENT:
            made = overlaid(self.texts[self.into], self.document.source, guess.loc, guess.value)
            return ({**self.texts, self.into: made}, "") if made else None
        source = source_of(self.document, guess)
        if guess.value is ABSENT:
            found = edits.remove(source, guess.loc)
        else:
            found = edits.put(source, guess.loc, guess.value)
        if not found:
            return None
        texts = dict(self.texts)
        for edit in found:
            name = edit.span.file
            texts[name] = edits.apply(texts.get(name, source.texts[name]), [edit])
        shared = next((edit.span for edit in found if edit.copies > 1), None)
        if shared is None:
            return texts, ""
        return texts, (
            f"`{guess.text}` is written for several entries at once ({shared.file}:{shared.line}), "
            "and not all of them were edited so; `--into FILE` writes an overlay for this one"
        )

    def _wrong(self, file: EditedFile, rendered: File, change: Change, bundles: Mapping[str, Bundle]) -> str:
        """Why a changed spec is not what the host has; empty if it is."""
        after = _file(bundles, file.host, file.path)
        before = _file(self.bundles, file.host, file.path)
        if after is None or before is None:
            return "removes the file"
        if not _has(bundles, change):
            return "does not make it"
        if others := list(_others(file, before, after)):
            return f"makes it, and would change {', '.join(others[:3])} too, which the host has otherwise"
        allowed = {rendered.origin, rendered.origin.partition(".")[0]}
        if rendered.origin != "hosts":
            for host, path, origin in _changed(self.bundles, bundles):
                if origin not in allowed and not self._is_edited_so(host, path, bundles):
                    return f"makes it, and would change {path} on {host} too"
        return ""

    def _is_edited_so(self, host: str, path: str, bundles: Mapping[str, Bundle]) -> bool:
        """True if a file that a changed spec changes, too, was edited on its host in the same way."""
        file = self.edited.get((host, path))
        before, after = _file(self.bundles, host, path), _file(bundles, host, path)
        return (
            file is not None
            and file.text is not None
            and before is not None
            and after is not None
            and not list(_others(file, before, after))
        )

    def _check_contradiction(self, change: Change, bundles: Mapping[str, Bundle]) -> None:
        for one in self.taken:
            if not _has(bundles, one):
                raise ContradictionError(
                    f"{one.host} and {change.host} have different edits of one value of the spec: "
                    f"{one.path} has {one.what}, {change.path} has {change.what}"
                )

    def _refuse(self, file: EditedFile, what: str, reason: str) -> None:
        self.refused.append(Refused(file.host, file.place, what, reason))


def _unfit(file: EditedFile, rendered: File | None) -> str:
    """Why a file cannot be brought home at all; empty if that can be tried."""
    if rendered is None or not file.deployed:
        return "the spec makes no such file"
    if file.text is None:
        return "it is not text, or too large, or has a private key, so the host keeps it"
    if rendered.digest != file.deployed and not same_meaning(
        file.path, file.text, rendered.content.decode("utf-8", "replace")
    ):
        return "the spec has changed the file, too, since it was deployed"
    return ""


def _derived(document: Document, rendered: File) -> str:
    if not rendered.origin:
        return "it is swarmctl's own, and the spec does not decide it"
    kind, _, name = rendered.origin.partition(".")
    if kind == "robots" and name in document.spec.robots:
        of = document.spec.robots[name].type
        if of not in document.own_types:
            return (
                f"no value of `{rendered.origin}` makes it so; it may come from the type `{of}`, which "
                f"swarmctl ships: `swarmctl driver new` writes a type of your own"
            )
    return f"it follows from several values of the spec (`{rendered.origin}`), and no single one makes it so"


def _file(bundles: Mapping[str, Bundle], host: str, path: str) -> File | None:
    files = bundles[host].files if host in bundles else ()
    return next((one for one in files if one.path == path), None)


def _has(bundles: Mapping[str, Bundle], change: Change) -> bool:
    """True if the changed value is what the spec makes now."""
    file = _file(bundles, change.host, change.path)
    if file is None:
        return False
    text = file.content.decode("utf-8", "replace")
    values = values_of(file.path, text)
    if not change.key or values is None:
        return change.new in text.splitlines()
    return equal(values.get(change.key, ABSENT), change.new)


def _others(file: EditedFile, before: File, after: File) -> Iterator[str]:
    """What differs in the file from before and from what the host has."""
    texts = [before.content.decode("utf-8", "replace"), after.content.decode("utf-8", "replace")]
    was, now, wanted = (values_of(file.path, text) for text in (*texts, file.text or ""))
    if was is None or now is None or wanted is None:
        old, edited = texts[0].splitlines(), (file.text or "").splitlines()
        yield from (repr(line) for line in texts[1].splitlines() if line not in old and line not in edited)
        return
    for key in dict.fromkeys((*was, *now)):
        value = _at(now, key)
        if not equal(value, _at(was, key)) and not equal(value, _at(wanted, key)):
            yield ".".join(map(str, key))


def _at(values: Values, key: Key) -> Any:
    return values.get(key, ABSENT)


def _changed(before: Mapping[str, Bundle], after: Mapping[str, Bundle]) -> Iterator[tuple[str, str, str]]:
    """The files that differ, with host and origin."""
    for host in dict.fromkeys((*before, *after)):
        old = {one.path: one for one in before[host].files} if host in before else {}
        new = {one.path: one for one in after[host].files} if host in after else {}
        for path in dict.fromkeys((*old, *new)):
            one, two = old.get(path), new.get(path)
            if one is None or two is None or one.digest != two.digest:
                yield host, path, (one or two).origin  # type: ignore[union-attr]


def _shown(value: Any) -> str:
    return "none" if value is ABSENT else str(value)
