"""A small editor: opens files in a language server over stdio and asks what a person would see there."""

from __future__ import annotations

import itertools
import json
import queue
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tests.timing import PATIENCE

OFFLINE = {"schemaStore": {"enable": False}}
CAPABILITIES: dict[str, Any] = {
    "textDocument": {
        "completion": {"completionItem": {"snippetSupport": True, "documentationFormat": ["markdown"]}},
        "hover": {"contentFormat": ["markdown"]},
        "publishDiagnostics": {},
    }
}


class LanguageServer:
    """One conversation. Requests of the server are answered, its diagnostics kept by document."""

    def __init__(self, process: subprocess.Popen[bytes], folder: Path, settings: dict[str, Any]) -> None:
        self._process = process
        self._folder = folder
        self._settings = settings
        self._received: queue.Queue[dict[str, Any]] = queue.Queue()
        self._diagnostics: dict[str, list[dict[str, Any]]] = {}
        self._numbers = itertools.count(1)
        threading.Thread(target=self._listen, daemon=True).start()

    def start(self) -> None:
        folder = self._folder.as_uri()
        self._ask("initialize", {"processId": None, "rootUri": folder, "capabilities": CAPABILITIES})
        self._notify("initialized", {})
        self._notify("workspace/didChangeConfiguration", {"settings": None})  # it asks for them then

    def diagnostics(self, text: str, name: str = "") -> list[dict[str, Any]]:
        """What the server underlines in a text, opened as the file ``name`` or as any other."""
        return self._diagnostics[self._opened(text, name)]

    def completion(self, text: str) -> dict[str, dict[str, Any]]:
        """What is offered at the mark ``|`` of a text, by label."""
        found = self._ask("textDocument/completion", self._at_mark(text))
        return {item["label"]: item for item in found["items"]}

    def hover(self, text: str) -> str:
        """The text that is shown over the mark ``|``, without the backslashes of its Markdown."""
        found = self._ask("textDocument/hover", self._at_mark(text))
        return str(found["contents"]["value"]).replace("\\", "") if found else ""

    def _at_mark(self, text: str) -> dict[str, Any]:
        before, _, after = text.partition("|")
        uri = self._opened(before + after)
        line, column = before.count("\n"), len(before) - before.rfind("\n") - 1
        return {"textDocument": {"uri": uri}, "position": {"line": line, "character": column}}

    def _opened(self, text: str, name: str = "") -> str:
        """A text as a new document of the folder, once the server has checked it."""
        uri = (self._folder / (name or f"{next(self._numbers)}.yaml")).as_uri()
        document = {"uri": uri, "languageId": "yaml", "version": 1, "text": text}
        self._notify("textDocument/didOpen", {"textDocument": document})
        while uri not in self._diagnostics:
            self._receive()
        return uri

    def _ask(self, method: str, params: dict[str, Any]) -> Any:
        number = next(self._numbers)
        self._send({"id": number, "method": method, "params": params})
        while True:
            message = self._receive()
            if message.get("id") == number and "method" not in message:
                assert "error" not in message, message
                return message["result"]

    def _notify(self, method: str, params: dict[str, Any]) -> None:
        self._send({"method": method, "params": params})

    def _send(self, message: dict[str, Any]) -> None:
        body = json.dumps({"jsonrpc": "2.0", **message}).encode()
        assert self._process.stdin is not None
        self._process.stdin.write(b"Content-Length: %d\r\n\r\n%b" % (len(body), body))
        self._process.stdin.flush()

    def _receive(self) -> dict[str, Any]:
        message = self._received.get(timeout=PATIENCE)
        if message.get("method") == "textDocument/publishDiagnostics":
            self._diagnostics[message["params"]["uri"]] = message["params"]["diagnostics"]
        elif "method" in message and "id" in message:
            self._send({"id": message["id"], "result": self._answer(message)})
        return message

    def _answer(self, message: dict[str, Any]) -> Any:
        """What the server asks of an editor is its settings; the rest it only announces."""
        if message["method"] != "workspace/configuration":
            return None
        return [self._settings if one["section"] == "yaml" else None for one in message["params"]["items"]]

    def _listen(self) -> None:
        out = self._process.stdout
        assert out is not None
        while header := out.readline():
            length = 0
            while header.strip():
                name, _, value = header.partition(b":")
                length = int(value) if name.lower() == b"content-length" else length
                header = out.readline()
            self._received.put(json.loads(out.read(length)))


@contextmanager
def running(server: Path, folder: Path, settings: dict[str, Any] | None = None) -> Iterator[LanguageServer]:
    """A YAML language server that looks nowhere but on the disk, with these settings."""
    with subprocess.Popen(
        [server, "--stdio"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    ) as process:
        try:
            editor = LanguageServer(process, folder, OFFLINE | (settings or {}))
            editor.start()
            yield editor
        finally:
            process.kill()
