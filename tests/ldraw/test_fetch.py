"""The download of the library, against a server on this machine."""

from __future__ import annotations

import io
import json
import threading
import zipfile
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest

from technic.errors import InputError, MissingDependency, UsageError
from technic.ldraw import fetch as fetching
from technic.ldraw.fetch import fetch, library_target
from technic.ldraw.library import find_library
from tests.ldraw.small_library import files_with, line, part, there, write_zip

ETAG = '"first"'


class Server:
    """What the next answers are, and what was asked."""

    def __init__(self, body: bytes):
        self.body = body
        self.etag = ETAG
        self.cut = None  # break off after that many bytes
        self.status = 200
        self.ranges = True
        self.location = None
        self.length = None  # a lie about the length
        self.asked: list[dict[str, str]] = []
        outer = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self):
                outer.answer(self)

            def log_message(self, *_):
                pass

        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        threading.Thread(target=self._server.serve_forever, daemon=True).start()
        self.url = f"http://127.0.0.1:{self._server.server_port}/complete.zip"

    def answer(self, handler):
        headers = dict(handler.headers)
        self.asked.append(headers)
        if self.location or self.status >= 400:
            handler.send_response(302 if self.location else self.status)
            if self.location:
                handler.send_header("Location", self.location)
            handler.send_header("Content-Length", "0")
            handler.end_headers()
            return
        start = 0
        wanted = headers.get("Range")
        if wanted and self.ranges and headers.get("If-Range") == self.etag:
            start = int(wanted.removeprefix("bytes=").rstrip("-"))
        handler.send_response(206 if start else 200)
        handler.send_header("ETag", self.etag)
        handler.send_header("Content-Length", str(self.length or len(self.body) - start))
        if start:
            size = len(self.body)
            handler.send_header("Content-Range", f"bytes {start}-{size - 1}/{size}")
        handler.end_headers()
        end = len(self.body) if self.cut is None else self.cut
        handler.wfile.write(self.body[start:end])
        handler.close_connection = True

    def close(self):
        self._server.shutdown()
        self._server.server_close()


@pytest.fixture(scope="session")
def zipped(tmp_path_factory) -> bytes:
    files = files_with({"parts/xbeam.dat": part(line("connhole.dat"), title="Odd Beam")})
    return write_zip(tmp_path_factory.mktemp("zip") / "c.zip", files, "ldraw/").read_bytes()


@pytest.fixture
def server(zipped):
    made = Server(zipped)
    yield made
    made.close()


@pytest.fixture
def target(tmp_path, monkeypatch):
    monkeypatch.setenv("TECHNIC_DATA", str(tmp_path / "data"))
    monkeypatch.setenv("TECHNIC_CACHE", str(tmp_path / "cache"))
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv("LDRAWDIR", raising=False)
    return library_target()


def leftovers(target):
    return sorted(path.name for path in target.parent.iterdir())


def test_a_fetched_library_is_found_without_being_named(server, target, zipped):
    seen = []
    done = fetch(server.url, target, progress=lambda done, total: seen.append((done, total)))
    assert (done.path, done.size, done.resumed) == (target, len(zipped), 0)
    assert target.read_bytes() == zipped
    assert seen[-1] == (len(zipped), len(zipped))
    assert leftovers(target) == ["complete.zip"]
    library = there(find_library())
    assert library.path == target
    assert library.key_of("xbeam") == "parts/xbeam.dat"


def test_a_broken_download_goes_on_where_it_stopped(server, target, zipped):
    server.cut = 1000
    with pytest.raises(MissingDependency, match="goes on where it stopped"):
        fetch(server.url, target)
    assert not target.exists()
    server.cut = None
    done = fetch(server.url, target)
    assert server.asked[1]["Range"] == "bytes=1000-"
    assert done.resumed == 1000
    assert target.read_bytes() == zipped


@pytest.mark.parametrize("change", ["other file", "no ranges", "damaged note"])
def test_it_starts_anew_when_the_rest_would_not_fit(server, target, zipped, change):
    server.cut = 1000
    with pytest.raises(MissingDependency):
        fetch(server.url, target)
    server.cut = None
    if change == "other file":
        server.etag = '"second"'
    elif change == "no ranges":
        server.ranges = False
    else:
        target.with_name("complete.zip.part.json").write_text("{", encoding="utf-8")
    assert fetch(server.url, target).resumed == 0
    assert target.read_bytes() == zipped


def test_a_failed_fetch_leaves_the_library_that_was_there(server, target, zipped):
    fetch(server.url, target)
    server.body = b"<html>maintenance</html>"
    with pytest.raises(InputError, match="no zip"):
        fetch(server.url, target)
    assert target.read_bytes() == zipped
    assert leftovers(target) == ["complete.zip"]


def zip_of(**members: bytes) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(name.replace("__", "/"), data)
    return stream.getvalue()


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (b"", "no zip"),
        (zip_of(readme=b"hello"), "no LDraw parts library"),
        (zip_of(parts__1=b"0 x", p__1=b"\0" * 2**28), "unpacks to"),
    ],
)
def test_what_is_no_library_is_refused_and_deleted(server, target, body, message):
    server.body = body
    with pytest.raises(InputError, match=message):
        fetch(server.url, target)
    assert leftovers(target) == []


def test_absurd_sizes_are_refused(server, target, monkeypatch):
    server.length = 2**40
    with pytest.raises(InputError, match="larger than any parts library"):
        fetch(server.url, target)
    server.length = None
    monkeypatch.setattr(fetching, "MAX_BYTES", 500)
    with pytest.raises(InputError, match="larger than any parts library"):
        fetch(server.url, target)


def test_what_the_server_refuses_is_said(server, target):
    server.status = 404
    with pytest.raises(MissingDependency, match="404"):
        fetch(server.url, target)


def test_no_server(target):
    with pytest.raises(MissingDependency, match="broke off"):
        fetch("http://127.0.0.1:9/complete.zip", target, timeout=2.0)


@pytest.mark.parametrize("url", ["file:///etc/passwd", "ftp://127.0.0.1/x", "complete.zip"])
def test_only_web_addresses(target, url):
    with pytest.raises(UsageError, match="web address"):
        fetch(url, target)


def test_a_redirection_to_a_file_is_not_followed(server, target):
    server.location = "file:///etc/passwd"
    with pytest.raises(MissingDependency):
        fetch(server.url, target)
    assert not target.exists()


def test_a_folder_that_cannot_be_written(server, tmp_path):
    (tmp_path / "file").write_text("no folder")
    with pytest.raises(UsageError, match="cannot be written"):
        fetch(server.url, tmp_path / "file" / "complete.zip")


# --- on the command line ----------------------------------------------------------------------
def test_fetch_and_cache_commands(run, server, target, monkeypatch, tmp_path):
    monkeypatch.setenv("TECHNIC_LIBRARY_URL", server.url)
    code, out, err = run("parts", "fetch")
    assert (code, out) == (0, "")
    assert str(target) in err
    _, out, _ = run("parts", "cache", "--json", "-")
    lists, solids = json.loads(out)["caches"]
    assert (lists["files"], solids["files"]) == (1, 0)
    assert (lists["limit_bytes"], solids["limit_bytes"]) == (None, 500 * 2**20)
    assert lists["bytes"] > 0
    solids_folder = tmp_path / "cache" / "solids"
    solids_folder.mkdir()
    for name in ("0a.zip", "0b.txt", ".solid-x", "mine.odt"):
        (solids_folder / name).write_text("x")
    _, out, _ = run("parts", "cache")
    assert "solid models of library parts: 3 files" in out
    stranger = tmp_path / "cache" / "libraries" / "mine.odt"
    stranger.write_text("not the program's")
    code, out, err = run("parts", "cache", "--clear")
    assert "0 files" in out
    assert "deleted 4 files" in err
    assert stranger.exists()
    assert [path.name for path in solids_folder.iterdir()] == ["mine.odt"]
    assert run("parts", "fetch", "--url", "gopher://x")[0] == 2
    server.status = 503
    assert run("parts", "fetch")[0] == 4


def test_doctor_says_what_is_there_and_what_is_missing(run, server, target, monkeypatch):
    code, out, _ = run("doctor", "--no-picture")
    assert code == 0
    assert "technic parts fetch" in " ".join(out.split())
    fetch(server.url, target)
    code, out, _ = run("doctor", "--no-picture", "--json", "-")
    found = json.loads(out)
    assert code == 0
    assert found["library"]["path"] == str(target)
    assert (found["library"]["parts"], found["library"]["release"]) == (1, "2026-02")
    assert found["shadow"]["found"] is False
    assert found["packages"]["numpy"]
    monkeypatch.setenv("LDRAWDIR", str(target.parent / "nowhere"))
    code, out, _ = run("doctor", "--no-picture")
    assert code == 0
    assert "Correct LDRAWDIR" in " ".join(out.split())
