"""Who is refused by the server of the explorer, and what it does with messages that are none."""

import http.client
import json
import struct
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from topleft._apps.explore.content import scene
from topleft._apps.explore.messages import pack, read_header, split, unpack
from topleft._apps.explore.session import Content, Reply

pytest.importorskip("starlette", reason="the explorer needs its extra: pip install '.[explore]'")
pytest.importorskip("uvicorn", reason="the explorer needs its extra: pip install '.[explore]'")
sockets = pytest.importorskip("websockets.sync.client", reason="the explorer needs its extra")

from websockets.exceptions import ConnectionClosed, InvalidStatus  # noqa: E402

import topleft as tl  # noqa: E402
from topleft._apps.explore import server as module  # noqa: E402
from topleft._apps.explore.open import open_page  # noqa: E402
from topleft._apps.explore.server import Server  # noqa: E402

TRIANGLE = {"n_components": 2, "size": [8, 8], "origin": ["0", "0"], "drawings": [{"triangles": 1}]}
PARTS = [memoryview(np.array(rows, kind).tobytes()) for rows, kind in (
    ([[1, 1], [7, 1], [1, 7]], np.float64), ([[0, 1, 2]], np.int32),
)]  # fmt: skip


@pytest.fixture
def server():
    found = Server(Content())
    found.start()
    yield found
    found.close()


def get(server, path, **headers):
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=10)
    connection.putrequest("GET", path, skip_host="Host" in headers)
    for name, value in headers.items():
        connection.putheader(name, value)
    connection.endheaders()
    found = connection.getresponse()
    return found.status, found.read().decode(), found.headers


def connect(server, token=None, origin=True, **more):
    origin = f"http://127.0.0.1:{server.port}" if origin is True else origin
    url = f"ws://127.0.0.1:{server.port}/{server.token if token is None else token}/socket"
    return sockets.connect(url, origin=origin, max_size=None, compression=None, **more)


def ask(page, name, parts=(), **given):
    page.send(pack({"do": name, "id": 1, **given}, [*parts]))
    return answer_of(page.recv(timeout=20))


def answer_of(frame):
    (n,) = struct.unpack_from("<I", frame)
    return json.loads(frame[4 : 4 + n])


def refusal(server, **given):
    with pytest.raises(InvalidStatus) as caught, connect(server, **given):
        pass
    return caught.value.response.status_code, caught.value.response.body.decode().strip()


# Pages and files


def test_page_and_its_files_are_served_with_the_token(server):
    for name, kind in (("", "text/html"), ("explore.js", "text/javascript"), ("explore.css", "text/css")):
        status, text, headers = get(server, f"/{server.token}/{name}")
        assert (status, headers["Content-Type"].split(";")[0]) == (200, kind)
        assert text.strip()
        assert "default-src 'none'" in headers["Content-Security-Policy"]


@pytest.mark.parametrize("path", ["/", "/explore.js", "/wrong/", "/wrong/explore.js", "/%00/", "/wrong/socket"])
def test_wrong_or_missing_token_is_refused(server, path):
    assert get(server, path)[:2] == (403, "The address must hold the token that the terminal shows.\n")


@pytest.mark.parametrize(
    "name", ["../server.py", "%2e%2e/server.py", "..%2fserver.py", "/etc/passwd", "index.html", "x"]
)
def test_path_outside_is_refused(server, name):
    assert get(server, f"/{server.token}/{name}")[:2] == (404, "There is no such file here.\n")


@pytest.mark.parametrize("host", ["evil.example", "evil.example:80", "127.0.0.1", "127.0.0.1:1"])
def test_foreign_host_is_refused(server, host):
    status, text, _ = get(server, f"/{server.token}/", Host=host)
    assert (status, text) == (403, f"Host must be 127.0.0.1:{server.port}: this page is for this machine alone.\n")


def test_foreign_host_is_refused_by_every_name_of_this_machine():
    for name in ("localhost", "::1"):
        here = Server(Content(), name)
        assert here.refusal({"host": f"evil.example:{here.port}"}, here.token, is_socket=False).startswith(
            "Host must be"
        )
        assert not here.refusal({"host": f"localhost:{here.port}"}, here.token, is_socket=False)


def test_foreign_origin_is_refused(server):
    told = (403, "Origin must be this page: others may not talk to it.")
    assert get(server, f"/{server.token}/", Origin="http://evil.example")[:2] == (told[0], told[1] + "\n")
    for origin in ("http://evil.example", f"https://127.0.0.1:{server.port}", "null", None):
        assert refusal(server, origin=origin) == told


def test_second_user_without_the_token_is_refused(server):
    for token in ("", "x", server.token[:-1], server.token + "x"):
        assert refusal(server, token=token) == (403, "The address must hold the token that the terminal shows.")


def test_other_methods_are_refused(server):
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=10)
    connection.request("PUT", f"/{server.token}/")
    assert connection.getresponse().status == 405


def test_page_names_nothing_of_the_network():
    folder = Path(module.__file__).parent / "page"
    for path in (one for one in folder.iterdir() if one.suffix != ".wasm"):
        text = path.read_text(encoding="utf-8").replace("http://www.w3.org/2000/svg", "")
        assert "//" not in text.replace("// ", "").replace("//\n", "").replace("---", ""), path.name


# Messages


def test_two_pages_talk_at_a_time(server):
    with connect(server) as one, connect(server) as two:
        for page in (one, two, one):
            assert ask(page, "hello")["tab"] == "pixels"


# Pages without a socket


def post(server, frame, name="ask/1", token=None, **headers):
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=20)
    headers = {"Origin": f"http://127.0.0.1:{server.port}"} | headers
    connection.request("POST", f"/{server.token if token is None else token}/{name}", frame, headers)
    found = connection.getresponse()
    return found.status, found.read()


@pytest.mark.parametrize(
    "question", [{"do": "hello"}, {"do": "pixels.export", **TRIANGLE, "kind": "code"}, {"do": "no"}, {}]
)
def test_post_is_answered_as_a_socket_is(server, question):
    frame = pack({"id": 1, **question}, PARTS)
    with connect(server) as page:
        page.send(frame)
        assert post(server, frame) == (200, page.recv(timeout=20))


def test_post_of_a_page_finds_what_the_page_has_kept(server):
    opened = post(server, pack({"id": 1, "do": "mesh.open", "name": "a.obj"}, [b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3"]))
    assert answer_of(opened[1])["n_triangles"] == 1
    kept = [answer_of(post(server, pack({"id": 2, "do": "mesh.open"}, []), f"ask/{key}")[1])["name"] for key in "12"]
    assert kept == ["a.obj", "torus-knot"]


def test_post_of_strangers_is_refused(server):
    frame = pack({"id": 1, "do": "hello"}, [])
    assert post(server, frame, Origin="http://evil.example") == (
        403,
        b"Origin must be this page: others may not talk to it.\n",
    )
    assert post(server, frame, token="x") == (403, b"The address must hold the token that the terminal shows.\n")
    for name in ("", "ask", "ask/", "tell/1", "ask/" + "1" * 65):
        assert post(server, frame, name) == (404, b"There is nothing to ask here.\n")


def test_post_that_is_too_large_is_refused(server, monkeypatch):
    monkeypatch.setattr(module, "MAX_MESSAGE_BYTES", 1000)
    assert post(server, bytes(1001)) == (413, b"A message may have 1000 bytes.\n")


def test_page_that_posts_nothing_for_long_is_closed(monkeypatch):
    monkeypatch.setattr(module, "POSTING_SECONDS", 0.2)
    monkeypatch.setattr(module, "MAX_PAGES", 1)
    server, frame = Server(Content(), idle=0.5), pack({"id": 1, "do": "hello"}, [])
    server.start()
    assert post(server, frame)[0] == 200
    assert post(server, frame, "ask/2") == (403, b"At most 1 pages may be open at a time.\n")
    time.sleep(0.4)
    assert post(server, frame, "ask/2")[0] == 200
    server._thread.join(10)
    assert not server._thread.is_alive()


def test_more_pages_than_may_be_open_are_refused(server, monkeypatch):
    monkeypatch.setattr(module, "MAX_PAGES", 1)
    with connect(server) as page:
        ask(page, "hello")
        assert refusal(server) == (403, "At most 1 pages may be open at a time.")


@pytest.mark.parametrize("frame", [b"", b"abc", b"\xff\xff\xff\x7f", pack({"id": 1}, [])[:-4], b"\x04\x00\x00\x00nope",
                                   struct.pack("<I", 2) + b"[]", struct.pack("<I", 6) + b'{"a":\xff', "[" * 10000,
                                   '{"do": NaN}', '{"do": 1e999}',
                                   '{"do": 1' + "0" * 400 + "}", "no JSON", '{"parts": [9], "id": 1}'])  # fmt: skip
def test_broken_message_is_answered_by_a_sentence_and_the_next_one_as_usual(server, frame):
    with connect(server) as page:
        page.send(frame)
        told = answer_of(page.recv(timeout=20))["error"]
        assert told
        assert "Traceback" not in told
        assert ask(page, "hello")["id"] == 1


def test_huge_message_ends_the_page_and_not_the_server(server, monkeypatch):
    small = Server(Content())
    monkeypatch.setattr(module, "MAX_MESSAGE_BYTES", 1 << 16)
    small.start()
    try:
        with connect(small) as page:
            page.send(b"x" * (1 << 17))
            with pytest.raises(ConnectionClosed) as caught:
                page.recv(timeout=20)
        assert caught.value.rcvd.code == 1009
        with connect(small) as page:
            assert ask(page, "hello")["tab"] == "pixels"
    finally:
        small.close()


def test_huge_header_is_refused(server):
    with connect(server) as page:
        page.send(struct.pack("<I", 5 << 20) + b" " * (5 << 20))
        assert "a message must hold its header" in answer_of(page.recv(timeout=20))["error"]


def test_enormous_and_broken_scenes_are_refused(server):
    wrong = [
        {"size": [10**9, 10**9]}, {"size": [257, 1]}, {"copies": 10**9}, {"copies": -1}, {"n_components": 5},
        {"origin": ["x", 0]}, {"drawings": [{"triangles": 2}]}, {"drawings": [{"triangles": 0}]},
        {"drawings": [{}]}, {"drawings": 3},
    ]  # fmt: skip
    with connect(server) as page:
        for one in wrong:
            assert "fault" not in ask(page, "engine.draw", PARTS, **TRIANGLE | one)["error"]
        assert ask(page, "engine.draw", PARTS, **TRIANGLE | {"origin": [str(10**30), "0"]})["drawings"][0]["refused"]
        assert "seconds" in ask(page, "engine.draw", PARTS, **TRIANGLE)["drawings"][0]


# Its end


def test_server_ends_when_its_pages_have_been_closed_for_a_while():
    server = Server(Content(), idle=0.2)
    server.start()
    with connect(server) as page:
        ask(page, "hello")
        time.sleep(0.5)
        assert ask(page, "hello")["id"] == 1
    server._thread.join(10)
    assert not server._thread.is_alive()


def test_explore_serves_meanwhile_and_returns_the_vertices_that_were_moved(capsys):
    explorer = tl.explore([[1, 1], [7, 1], [1, 7]], [[0, 1, 2]], 8, wait=False, browser=False)
    assert capsys.readouterr().out == f"topleft explore: {explorer.url}\n"
    assert explorer.vertices.tolist() == [[1, 1], [7, 1], [1, 7]]
    with explorer, connect(explorer._server) as page:
        moved = [[2, 2], [7, 1], [1, 7]]
        ask(page, "pixels.moved", vertices=moved)
        assert explorer.vertices.tolist() == moved


def test_explore_without_arguments_has_the_vertices_of_its_two_triangles():
    with tl.explore(wait=False, browser=False) as explorer:
        assert explorer.vertices.tolist() == scene("shared-edge")["vertices"]


def test_waiting_explorer_returns_when_it_is_closed():
    made = []
    thread = threading.Thread(target=lambda: made.append(tl.explore("torus-knot", browser=False)))
    server_starts = Server.start
    try:
        Server.start = lambda self: (server_starts(self), made.append(self))[0]
        thread.start()
        while not made:
            time.sleep(0.01)
        assert thread.is_alive()
        made[0].close()
        thread.join(10)
    finally:
        Server.start = server_starts
    assert made[1].vertices is None


@pytest.mark.parametrize(("display", "n"), [("", 0), (":0", 1)])
def test_browser_is_opened_where_there_is_a_display(monkeypatch, display, n):
    opened = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv("DISPLAY", display)
    for name in ("WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(name, raising=False)
    with tl.explore("shared-edge", wait=False) as explorer:
        assert opened == [explorer.url] * n


def test_host_for_others_is_warned_of():
    with pytest.warns(UserWarning, match="whoever reaches 0.0.0.0 and knows the address sees the page"):
        explorer = open_page(Content(), host="0.0.0.0", browser=False)
    explorer.close()


def test_command_serves_until_ctrl_c(folder):
    code = "import sys, topleft.cli; sys.exit(topleft.cli.main(sys.argv[1:]))"
    command = [sys.executable, "-c", code, "explore", "two-triangles", "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        url = process.stdout.readline().split()[-1]
        host, token = url.split("/")[2], url.split("/")[3]
        connection = http.client.HTTPConnection(host, timeout=10)
        connection.request("GET", f"/{token}/")
        assert connection.getresponse().status == 200
        process.send_signal(2)
        _, told = process.communicate(timeout=20)
    assert (process.returncode, told) == (0, "")


@pytest.mark.parametrize(("arguments", "told"), [(["nowhere"], "nowhere: neither a file nor a scene"),
                                                 (["--port", "70000"], "--port must be from 0 to 65535"),
                                                 (["--idle", "0"], "--idle must be more than 0 seconds")])  # fmt: skip
def test_command_refuses_with_a_sentence(run, arguments, told):
    status, lines = run("explore", "--no-browser", *arguments)
    assert status == 2
    assert told in lines[-1]


# Frames


def test_frame_holds_its_arrays():
    arrays = {"a": np.arange(6, dtype=np.int32).reshape(2, 3), "b": np.array([True, False]), "c": b"text"}
    frame = pack(*split(Reply({"id": 3}, arrays)))
    found = unpack(frame)
    assert found["arrays"]["a"] == {"dtype": "int32", "shape": [2, 3], "part": 0}
    assert np.frombuffer(found["parts"][0], np.int32).tolist() == [0, 1, 2, 3, 4, 5]
    assert [bytes(part) for part in found["parts"][1:]] == [b"\x01\x00", b"text"]


def test_header_without_an_object_is_refused():
    with pytest.raises(ValueError, match="a message must begin with a JSON object, got list"):
        read_header("[]")
