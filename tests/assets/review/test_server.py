"""The server's contract: what it answers, and what it refuses in one line of JSON."""

import http.client
import json
import socket
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from clutter6d.assets.library import AssetLibrary
from clutter6d.assets.review.handler import MAX_BODY_BYTES
from clutter6d.assets.review.journal import ReviewJournal
from clutter6d.assets.review.page_files import PAGE_FILES
from clutter6d.assets.review.server import ReviewServer
from clutter6d.assets.review.session import ReviewSession
from clutter6d.errors import InvalidValueError
from tests.assets.review.conftest import hash_of

NAME = "box-001"
JSON = {"Content-Type": "application/json"}


@dataclass(frozen=True, kw_only=True)
class Answer:
    status: int
    headers: Mapping[str, str]
    content: bytes

    @property
    def json(self) -> Any:
        return json.loads(self.content)


def ask(server: ReviewServer, path: str, body: object = None, *, method: str = "", **headers: str) -> Answer:
    """Ask for a path below the secret one; a body that is not bytes is sent as JSON."""
    content = body if isinstance(body, bytes | None) else json.dumps(body).encode()
    return ask_raw(server, f"/{server.token}/{path}", content, method or ("GET" if body is None else "POST"), headers)


def ask_raw(
    server: ReviewServer, path: str, content: bytes | None, method: str, headers: Mapping[str, str] | None = None
) -> Answer:
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=10)
    named = {name.replace("_", "-"): value for name, value in (headers or {}).items()}
    connection.request(method, path, content, (JSON if content is not None else {}) | named)
    response = connection.getresponse()
    answer = Answer(status=response.status, headers=dict(response.getheaders()), content=response.read())
    connection.close()
    return answer


def check_refusal(answer: Answer, status: int, says: str = "") -> None:
    assert answer.status == status
    assert list(answer.json) == ["error"]
    assert "\n" not in answer.json["error"]
    assert says in answer.json["error"]
    assert answer.headers["Content-Type"] == "application/json"


def test_it_listens_on_one_address_of_this_machine_only(server: ReviewServer) -> None:
    assert server.server_address[0] == "127.0.0.1"
    with pytest.raises(ConnectionRefusedError), socket.create_connection(("127.0.0.2", server.server_port), timeout=2):
        pass


@pytest.mark.parametrize(("path", "kind"), [(path, kind) for path, (_, kind) in PAGE_FILES.items()])
def test_the_page_is_served_and_may_load_nothing_from_elsewhere(server: ReviewServer, path: str, kind: str) -> None:
    answer = ask(server, path)
    assert (answer.status, answer.headers["Content-Type"]) == (200, kind)
    assert "default-src 'none'" in answer.headers["Content-Security-Policy"]
    assert answer.headers["X-Content-Type-Options"] == "nosniff"


def test_the_list_has_every_asset_and_what_was_decided(server: ReviewServer, library: AssetLibrary) -> None:
    server.session.decide(hash_of(library, NAME), "reject", reason="torn")
    answer = ask(server, "api/assets").json
    assert (answer["library"], answer["reviewer"]) == ("library", "ada")
    assert [(row["name"], row["decision"], row["reason"]) for row in answer["assets"]] == [
        ("box-000", None, ""),
        ("box-001", "reject", "torn"),
        ("box-002", None, ""),
        ("box-003", None, ""),
    ]
    assert answer["undoable"]["asset_name"] == NAME


def test_an_asset_is_described_and_its_geometry_follows_in_one_block(
    server: ReviewServer, library: AssetLibrary
) -> None:
    asset = library.load(NAME)
    said = ask(server, f"api/assets/{asset.content_hash}").json
    assert (said["name"], said["mass_kg"]) == (NAME, asset.mass_properties.mass_kg)
    assert said["attributes"]["mass_from"] == "declared"
    assert said["licence"]["name"] == "Apache-2.0"
    assert [pose["height_m"] for pose in said["poses"]] == asset.stable.heights_m.tolist()
    block = ask(server, f"api/assets/{asset.content_hash}/geometry").content
    (visual,), (part,) = said["visual"], said["parts"]
    vertices = np.frombuffer(block, "<f4", 3 * visual["vertices"]).reshape(-1, 3)
    faces = np.frombuffer(block, "<u4", 3 * visual["faces"], offset=vertices.nbytes).reshape(-1, 3)
    np.testing.assert_array_equal(vertices, asset.visual[0].mesh.vertices)
    np.testing.assert_array_equal(faces, asset.visual[0].mesh.faces)
    assert len(block) == 12 * (visual["vertices"] + visual["faces"] + part["vertices"] + part["faces"])


def test_decisions_are_on_disk_when_they_are_acknowledged(server: ReviewServer, library: AssetLibrary) -> None:
    accepted = ask(server, "api/decisions", {"asset_hash": hash_of(library, NAME), "decision": "accept"})
    assert accepted.json["asset"]["decision"] == "accept"
    change = {"asset_hash": hash_of(library, NAME), "decision": "edit", "change": {"mass_kg": 2.5, "colour": "red"}}
    edited = ask(server, "api/decisions", change).json
    assert edited["asset"]["hash"] == hash_of(library, NAME) != change["asset_hash"]
    assert [entry.decision for entry in ReviewJournal(library.path).entries()] == ["accept", "edit"]
    undone = ask(server, "api/undo", {"entry_id": edited["undoable"]["entry_id"]}).json
    assert undone["asset"]["hash"] == change["asset_hash"]
    assert undone["asset"]["decision"] == "accept"
    assert undone["undoable"]["entry_id"] == accepted.json["entry_id"]


def test_tabs_at_the_same_time_decide_each_on_their_own(server: ReviewServer, library: AssetLibrary) -> None:
    names = library.names() * 5
    bodies = [{"asset_hash": hash_of(library, name), "decision": "accept"} for name in names]
    with ThreadPoolExecutor(5) as pool:
        answers = list(pool.map(lambda body: ask(server, "api/decisions", body), bodies))
    assert {answer.status for answer in answers} == {200}
    assert len(ReviewJournal(library.path).entries()) == len(names)


def test_of_two_edits_of_one_version_the_second_is_refused(server: ReviewServer, library: AssetLibrary) -> None:
    key = hash_of(library, NAME)
    body = {"asset_hash": key, "decision": "edit", "change": {"mass_kg": 2.5}}
    assert ask(server, "api/decisions", body).status == 200
    check_refusal(ask(server, "api/decisions", body | {"change": {"mass_kg": 3}}), 404, "may have been changed since")


PATHS = [
    "nothing", "index.html", "static/review.js", "../../../../etc/passwd", "..%2f..%2fetc%2fpasswd", "%2e%2e/icon.svg",
    "//etc/passwd", "review.js/", "review.js?x", "api", "api/assets/", "api/assets/box-001", "api/assets/../assets",
    "api/assets/" + "G" * 64, "api/assets/" + "0" * 64 + "/../../library.json", "api/decisions", "library.json",
]  # fmt: skip


@pytest.mark.parametrize("path", PATHS)
def test_nothing_else_is_served(server: ReviewServer, path: str) -> None:
    check_refusal(ask(server, path), 404)


def test_an_unknown_asset_is_not_found(server: ReviewServer) -> None:
    for path in ("api/assets/" + "0" * 64, "api/assets/" + "0" * 64 + "/geometry"):
        check_refusal(ask(server, path), 404, "has the version 000000000000")
    check_refusal(ask(server, "api/decisions", {"asset_hash": "0" * 64, "decision": "accept"}), 404)


def test_without_the_secret_path_nothing_is_answered(server: ReviewServer) -> None:
    for path in ("/", "/api/assets", f"/{server.token}", f"/{server.token[:-1]}/", f"/x{server.token}/", "*"):
        check_refusal(ask_raw(server, path, None, "GET"), 403, "open the address")


@pytest.mark.parametrize("host", ["evil.example", "localhost", "127.0.0.1", "127.0.0.1:1", "evil.example:{port}", ""])
def test_another_host_is_refused(server: ReviewServer, host: str) -> None:
    answer = ask(server, "api/assets", Host=host.format(port=server.server_port))
    check_refusal(answer, 403, "and nothing else")


@pytest.mark.parametrize("origin", ["https://evil.example", "null", "http://localhost", "file://"])
def test_another_origin_is_refused(server: ReviewServer, library: AssetLibrary, origin: str) -> None:
    body = {"asset_hash": hash_of(library, NAME), "decision": "accept"}
    check_refusal(ask(server, "api/decisions", body, Origin=origin), 403, "other pages")
    assert ReviewJournal(library.path).entries() == ()


GOOD_HASH = "a" * 64
BODIES = [
    (b"", 400, "body"),
    (b"{", 400, "Invalid JSON"),
    (b"[" * 50_000, 400, ""),
    (b"\xff\xfe", 400, ""),
    ({"decision": "accept"}, 400, "asset_hash"),
    ({"asset_hash": "../../x", "decision": "accept"}, 400, "asset_hash"),
    ({"asset_hash": GOOD_HASH, "decision": "undo"}, 400, "decision"),
    ({"asset_hash": GOOD_HASH, "decision": "accept", "who": "eve"}, 400, "who"),
    ({"asset_hash": GOOD_HASH, "decision": "edit", "change": {"licence": "CC0"}}, 400, "licence"),
    ({"asset_hash": GOOD_HASH, "decision": "edit", "change": {"mass_kg": -1}}, 400, "mass_kg"),
    ({"asset_hash": GOOD_HASH, "decision": "edit", "change": {"mass_kg": float("nan")}}, 400, "mass_kg"),
    ({"asset_hash": GOOD_HASH, "decision": "edit", "change": {"colour": "red\n"}}, 400, "colour"),
    ({"asset_hash": GOOD_HASH, "decision": "edit", "change": {"category": "x" * 61}}, 400, "category"),
    ({"asset_hash": GOOD_HASH, "decision": "reject", "reason": "x" * 501}, 400, "reason"),
    ({"asset_hash": GOOD_HASH, "decision": "reject"}, 400, "needs a reason"),
    (b" " * (MAX_BODY_BYTES + 1), 413, "at most"),
]


@pytest.mark.parametrize(("body", "status", "says"), BODIES)
def test_a_bad_body_is_refused(server: ReviewServer, body: object, status: int, says: str) -> None:
    check_refusal(ask(server, "api/decisions", body), status, says)
    assert server.session.status().undoable is None


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Content_Type": "text/plain"}, 415),
        ({"Content_Type": "application/x-www-form-urlencoded"}, 415),
        ({"Content_Length": "-1"}, 411),
        ({"Content_Length": "2e3"}, 411),
        ({"Content_Length": "9" * 40}, 413),
        ({"Content_Length": str(1 << 40)}, 413),
        ({"Transfer_Encoding": "chunked"}, 411),
    ],
)
def test_a_body_must_be_json_of_stated_length(server: ReviewServer, headers: dict[str, str], status: int) -> None:
    check_refusal(ask(server, "api/decisions", b"{}", **headers), status)


def test_undoing_what_is_not_the_last_decision_is_a_conflict(server: ReviewServer) -> None:
    check_refusal(ask(server, "api/undo", {"entry_id": "0" * 16}), 409, "not your last decision")


@pytest.mark.parametrize("method", ["PUT", "DELETE", "PATCH", "OPTIONS", "BREW"])
def test_other_methods_are_refused(server: ReviewServer, method: str) -> None:
    check_refusal(ask(server, "api/assets", method=method), 501)


def test_what_is_no_http_is_refused(server: ReviewServer) -> None:
    with socket.create_connection(("127.0.0.1", server.server_port), timeout=5) as connection:
        connection.sendall(b"\x16\x03\x01 hello\r\n\r\n")
        assert b'{"error":' in connection.recv(65_536)
    assert ask(server, "").status == 200


def test_a_damaged_asset_is_reported(server: ReviewServer, library: AssetLibrary) -> None:
    key = hash_of(library, NAME)
    next((library.path / "assets").glob(f"{NAME}-*/geometry.npz")).write_bytes(b"torn")
    check_refusal(ask(server, f"api/assets/{key}"), 400, "not a valid asset geometry")


def test_a_taken_port_is_a_mistake(server: ReviewServer, session: ReviewSession) -> None:
    with pytest.raises(InvalidValueError, match=f"--port {server.server_port}: Address already in use"):
        ReviewServer(session, server.server_port)
