"""The server of `mirrorbake view`."""

import http.client
import random
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import ThreadingHTTPServer
from pathlib import Path
from urllib.parse import quote

import numpy as np
import pytest

from mirrorbake.pem.export.web import WebOptions, WebPem
from mirrorbake.viewer.export import write_folder, write_single_file
from mirrorbake.viewer.page import is_built
from mirrorbake.viewer.server import Content, byte_range, make_server
from mirrorbake.viewer.text import text_of_bytes
from viewer_cases import CasePem, case_scene, case_source, cases

pytestmark = pytest.mark.skipif(
    not is_built(), reason="the viewer's page is not built: needs Node.js 18 or newer"
)


@contextmanager
def serving(content: Content) -> Iterator[ThreadingHTTPServer]:
    server = make_server(content)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield server
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


@pytest.fixture(scope="module")
def pem() -> WebPem:
    return WebPem(case_source(cases()[0], case_scene(cases()[0]), CasePem()), WebOptions(fallback=False))


@pytest.fixture(scope="module")
def server(pem: WebPem) -> Iterator[ThreadingHTTPServer]:
    with serving(Content(pem, "torus & <ball>")) as running:
        yield running


def ask(
    server: ThreadingHTTPServer, path: str, method: str = "GET", headers: dict[str, str] | None = None
) -> tuple[int, dict[str, str], bytes]:
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=20)
    try:
        connection.request(method, path, headers=headers or {})
        answer = connection.getresponse()
        return answer.status, {k.lower(): v for k, v in answer.getheaders()}, answer.read()
    finally:
        connection.close()


def test_the_server_listens_on_this_machine_alone(server: ThreadingHTTPServer) -> None:
    assert server.server_address[0] == "127.0.0.1"


def test_the_page_and_the_files_of_the_pem_have_their_types(server: ThreadingHTTPServer, pem: WebPem) -> None:
    for path, kind in (
        ("/", "text/html; charset=utf-8"),
        ("/index.html", "text/html; charset=utf-8"),
        ("/viewer.js", "text/javascript; charset=utf-8"),
        ("/viewer.css", "text/css; charset=utf-8"),
        ("/manifest.json?v=1", "application/json"),
        ("/poster.avif", "image/avif"),
        ("/mesh.bin.gz", "application/octet-stream"),
    ):
        status, headers, body = ask(server, path)
        assert (status, headers["content-type"]) == (200, kind)
        assert int(headers["content-length"]) == len(body)
        assert headers["x-content-type-options"] == "nosniff"
    assert ask(server, "/mesh.bin.gz")[2] == pem.read("mesh.bin.gz")
    assert b"torus &amp; &lt;ball&gt;" in ask(server, "/")[2]


def test_nothing_else_is_reached_in_ten_thousand_tries(server: ThreadingHTTPServer, tmp_path: Path) -> None:
    secret = tmp_path / "secret.txt"
    secret.write_text("secret")
    pieces = [
        "..",
        ".",
        "",
        "%2e%2e",
        "%252e%252e",
        "..%2f",
        "%5c..",
        "samples",
        "etc",
        "passwd",
        "viewer.js",
    ]
    pieces += [
        quote(str(secret)),
        str(secret)[1:],
        "proc/self/environ",
        "page.py",
        "%00",
        "\\",
        "manifest.json",
    ]
    own = [ask(server, path)[2] for path in ("/", "/viewer.js", "/manifest.json")]
    chance = random.Random(5)
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=20)
    for _ in range(10_000):
        path = (
            "/" + chance.choice(["", "/", "%2f"]) + "/".join(chance.choices(pieces, k=chance.randint(1, 6)))
        )
        connection.request("GET", path)
        answer = connection.getresponse()
        body = answer.read()
        if answer.status == 200:
            assert body in own, path
        else:
            assert answer.status in (400, 404), path
            assert b"secret" not in body
    connection.close()


def test_links_in_the_folder_of_the_page_lead_nowhere(server: ThreadingHTTPServer) -> None:
    for name in ("page/viewer.js", "../page.py", "server.py", "__init__.py"):
        assert ask(server, "/" + name)[0] == 404


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "PATCH", "OPTIONS", "TRACE", "MKCOL"])
def test_there_is_no_method_that_writes(server: ThreadingHTTPServer, method: str) -> None:
    assert ask(server, "/manifest.json", method)[0] == 501


def test_head_says_what_get_sends(server: ThreadingHTTPServer) -> None:
    status, headers, body = ask(server, "/manifest.json", "HEAD")
    assert (status, body) == (200, b"")
    assert int(headers["content-length"]) == len(ask(server, "/manifest.json")[2])


def test_pages_of_other_sites_are_not_answered(server: ThreadingHTTPServer) -> None:
    assert ask(server, "/", headers={"Host": "evil.example"})[0] == 403
    assert ask(server, "/", headers={"Host": f"localhost:{server.server_port}"})[0] == 200


def test_ranges_are_answered_as_http_has_them(server: ThreadingHTTPServer, pem: WebPem) -> None:
    whole = pem.read("mesh.bin.gz")
    for header, part in (
        ("bytes=0-9", whole[:10]),
        ("bytes=5-", whole[5:]),
        ("bytes=-7", whole[-7:]),
        ("bytes=3-999999999", whole[3:]),
    ):
        status, headers, body = ask(server, "/mesh.bin.gz", headers={"Range": header})
        assert (status, body) == (206, part)
        assert headers["content-range"].endswith(f"/{len(whole)}")
    status, headers, _ = ask(server, "/mesh.bin.gz", headers={"Range": f"bytes={len(whole)}-"})
    assert (status, headers["content-range"]) == (416, f"bytes */{len(whole)}")


@pytest.mark.parametrize(
    "header", ["lines=1-2", "bytes=1-2,4-5", "bytes=-", "bytes=5-2", "bytes=a-b", "bytes"]
)
def test_ranges_without_sense_are_ignored(header: str) -> None:
    assert byte_range(header, 10) is None


def test_a_folder_that_holds_something_else_is_left_alone(pem: WebPem, tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("years")
    with pytest.raises(ValueError, match="holds no page"):
        write_folder(pem, "title", tmp_path, lambda done, total, text: None)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.txt"]


# What the page's bytesOfText reads; its own test has the same table.
TEXTS = [
    (b"", ""),
    (b"\xff\xff", "\x7f\x7f`"),
    (b"\0\0\0", "\x80\x80"),
    (b"\x14\x28\x50\xa1\x42", "\u010a\u010a\u0108"),
    (b"\x78\xf1\xe3\xc7\x8f\x1e\x3c", "\u02bc\u02bc\u02bc\u02bc"),
    (b'"<\\\r\n\0\xe2\x80\xa8', "\x11\x0f\x0b@h(\x01b@*\x80"),
]


@pytest.mark.parametrize(("data", "text"), TEXTS)
def test_bytes_in_a_page_are_the_text_that_the_page_reads(data: bytes, text: str) -> None:
    assert text_of_bytes(data) == text


def test_bytes_in_a_page_take_a_seventh_more_and_need_no_escapes() -> None:
    data = np.random.default_rng(5).bytes(70_000)
    text = text_of_bytes(data)
    assert len(text.encode("utf-8")) <= 80_002
    assert not set('\0\n\r"<\\') & set(text)


def test_a_single_file_holds_the_first_picture_in_its_first_third(pem: WebPem, tmp_path: Path) -> None:
    path = tmp_path / "page.html"
    size = write_single_file(pem, "title", path, lambda done, total, text: None)
    text = path.read_text(encoding="utf-8")
    assert size == path.stat().st_size
    assert [text.count(f'mirrorbakeFile("{name}"') for name in pem.names] == [1] * len(pem.names)
    order = [text.index(f'mirrorbakeFile("{name}"') for name in pem.names]
    assert order == sorted(order)
    # A script must not end before its end.
    assert text.count("<script>") == text.count("</script>")
