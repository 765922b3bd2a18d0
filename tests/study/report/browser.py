"""A real browser without a screen: how a page measures up at a width, what it asks of the network, how it prints."""

from __future__ import annotations

import functools
import html
import http.server
import json
import os
import re
import shutil
import subprocess
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--disable-dev-shm-usage",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--hide-scrollbars",
    "--host-resolver-rules=MAP * ~NOTFOUND , EXCLUDE 127.0.0.1",
)
SECONDS = 120

# Frames, because a window can't be made as narrow as a phone; a frame's width is what its page sees as the screen's.
HARNESS = """<!DOCTYPE html><meta charset="utf-8"><link rel="icon" href="data:,"><body>
{frames}
<script>
onload = () => {{
  const seen = [...document.querySelectorAll("iframe")].map(frame => {{
    const page = frame.contentDocument, view = frame.contentWindow, root = page.documentElement;
    return {{
      width: view.innerWidth,
      scroll: root.scrollWidth,
      title: page.title,
      images: [...page.images].map(i => i.complete ? i.naturalWidth : 0),
      charts: [...page.querySelectorAll("svg.chart")].map(s => s.getBoundingClientRect().width),
      headings: [...page.querySelectorAll("h1,h2,h3,h4,h5,h6")].map(h => +h.tagName[1]),
      scripts: page.scripts.length,
      requests: view.performance.getEntriesByType("resource").map(r => r.name).filter(n => !n.startsWith("data:")),
    }};
  }});
  const result = document.createElement("pre");
  result.id = "result";
  result.textContent = JSON.stringify(seen);
  document.body.append(result);
}};
</script>"""


def find() -> str | None:
    """Return the browser: $CHROMIUM, or the first one on the path."""
    given = os.environ.get("CHROMIUM")
    return shutil.which(given) if given else next(filter(None, map(shutil.which, NAMES)), None)


def measure(page: Path, widths: tuple[int, ...]) -> tuple[list[dict], list[str]]:
    """Open a page at several widths; return what it measures at each, and what the browser's console said."""
    frames = "".join(f'<iframe src="{page.name}" width="{w}" height="900" style="border:0"></iframe>' for w in widths)
    harness = page.with_name(f"harness_{page.stem}.html")
    harness.write_text(HARNESS.format(frames=frames), encoding="utf-8")
    with _served(page.parent) as address:
        done = _run("--enable-logging=stderr", "--dump-dom", "--window-size=1400,1000", f"{address}/{harness.name}")
    (result,) = re.findall(r'<pre id="result">(.*?)</pre>', done.stdout, re.DOTALL)
    console = [line for line in done.stderr.splitlines() if "CONSOLE" in line]
    return json.loads(html.unescape(result)), console


def pdf_pages(page: Path) -> int:
    """Print a page to PDF beside it and return how many sheets that makes."""
    file = page.with_suffix(".pdf")
    _run(f"--print-to-pdf={file}", "--no-pdf-header-footer", page.as_uri())
    return len(re.findall(rb"/Type\s*/Page\b", file.read_bytes()))


def screenshot(page: Path, file: Path, width: int, height: int, scale: float = 1.0) -> Path:
    """Take a picture of the top of a page as seen on a screen of some width."""
    frame = f'<iframe src="{page.name}" width="{width}" height="{height}" style="border:0;display:block"></iframe>'
    harness = page.with_name(f"screen_{page.stem}.html")
    harness.write_text(
        f'<!DOCTYPE html><link rel="icon" href="data:,"><body style="margin:0">{frame}', encoding="utf-8"
    )
    with _served(page.parent) as address:
        size = (f"--window-size={width},{height}", f"--force-device-scale-factor={scale}", f"--screenshot={file}")
        _run(*size, f"{address}/{harness.name}")
    return file


def _run(*arguments: str) -> subprocess.CompletedProcess[str]:
    browser = find()
    assert browser, "no browser"
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        command = [browser, *FLAGS, f"--user-data-dir={profile}", *arguments]
        done = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=SECONDS, check=False)
    assert done.returncode == 0, f"{command} ended with {done.returncode}: {done.stderr[-2000:]}"
    return done


@contextmanager
def _served(folder: Path) -> Iterator[str]:
    """Serve a folder on this machine; files opened directly may not look into each other's frames."""

    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *arguments):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=str(folder)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{server.server_port}"
    finally:
        server.shutdown()
        server.server_close()
