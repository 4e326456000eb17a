"""A local server that speaks the chat-completions protocol: it checks what comes, and answers as it is told."""

import contextlib
import json
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

MODEL = "views-1"
KEY = "sk-test-4f1c9a"
GOOD = {
    "reasoning": "A cardboard box, hollow. So it is light.",
    "category": "Cardboard Box",
    "colour": "brown",
    "material": "cardboard",
    "mass_kg": 0.2,
    "friction": 0.5,
}


@dataclass(frozen=True, kw_only=True)
class Said:
    """One response: a model's text, or any body; late, cut short or with another status if need be."""

    text: str | None = None
    body: bytes | None = None
    status: int = 200
    finish_reason: str = "stop"
    refusal: str | None = None
    headers: dict[str, str] = field(default_factory=dict)
    delay_s: float = 0.0
    is_broken_off: bool = False


def good(**changes: object) -> Said:
    return Said(text=json.dumps(GOOD | changes))


def failure(status: int, message: str = "no", **headers: str) -> Said:
    body = json.dumps({"error": {"message": message, "type": "error", "code": None}}).encode()
    return Said(status=status, body=body, headers={name.replace("_", "-"): value for name, value in headers.items()})


@dataclass
class EndpointServer:
    """Answers the n-th question with the n-th of its script, then with the last again and again.

    Attributes:
        script: Responses, or functions of the question that make one.
        questions: The questions' JSON, in order.
        problems: What was wrong with the questions.
    """

    script: list[Said | Callable[[dict[str, Any]], Said]]
    url: str = ""
    questions: list[dict[str, Any]] = field(default_factory=list)
    keys: list[str] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    lock: threading.Lock = field(default_factory=threading.Lock)

    def take(self, path: str, key: str, question: dict[str, Any]) -> Said:
        with self.lock:
            self.questions.append(question)
            self.keys.append(key)
            self.problems += _problems(path, question)
            said = self.script[min(len(self.questions), len(self.script)) - 1]
        return said(question) if callable(said) else said


def _problems(path: str, question: dict[str, Any]) -> Iterator[str]:
    if path != "/v1/chat/completions":
        yield f"path {path}"
    if question.get("model") != MODEL:
        yield f"model {question.get('model')}"
    pictures = [part for part in question["messages"][1]["content"] if part["type"] == "image_url"]
    if len(pictures) != 4:
        yield f"{len(pictures)} pictures"
    if not all(picture["image_url"]["url"].startswith("data:image/png;base64,iVBOR") for picture in pictures):
        yield "a picture that is no PNG"


@contextlib.contextmanager
def serve(*script: Said | Callable[[dict[str, Any]], Said]) -> Iterator[EndpointServer]:
    """Run a server on this machine's own address for a while; fails if it was asked wrongly."""
    endpoint = EndpointServer(script=list(script))

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            length = int(self.headers["Content-Length"])
            question = json.loads(self.rfile.read(length))
            said = endpoint.take(self.path, self.headers.get("Authorization", ""), question)
            time.sleep(said.delay_s)
            body = said.body if said.body is not None else _completion(said)
            with contextlib.suppress(BrokenPipeError, ConnectionResetError):
                self.send_response(said.status)
                for name, value in ({"Content-Type": "application/json"} | said.headers).items():
                    self.send_header(name, value)
                self.send_header("Content-Length", str(len(body)))
                self.end_headers()
                self.wfile.write(body[: len(body) // 2] if said.is_broken_off else body)
            self.close_connection = self.close_connection or said.is_broken_off

        def log_message(self, *_: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    server.daemon_threads = True
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True)
    thread.start()
    endpoint.url = f"http://127.0.0.1:{server.server_address[1]}/v1"
    try:
        yield endpoint
    finally:
        server.shutdown()
        server.server_close()
        thread.join()
    assert not endpoint.problems


def _completion(said: Said) -> bytes:
    message = {"role": "assistant", "content": said.text, "refusal": said.refusal}
    choice = {"index": 0, "message": message, "finish_reason": said.finish_reason, "logprobs": None}
    usage = {"prompt_tokens": 1000, "completion_tokens": 100, "total_tokens": 1100}
    content = {"id": "1", "object": "chat.completion", "created": 0, "model": MODEL, "choices": [choice]}
    return json.dumps(content | {"usage": usage}).encode()
