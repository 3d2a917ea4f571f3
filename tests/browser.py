"""Pages as Chromium shows them, spoken to over its debugging pipe: sizes, schemes, messages of the console, pictures."""

from __future__ import annotations

import base64
import contextlib
import json
import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
WIDTHS, SCHEMES = (1400, 420), ("light", "dark")


class Browser:
    """One tab."""

    def __init__(self, sent: int, received: int) -> None:
        self._sent, self._received = sent, received
        self._number, self._rest = 0, b""
        self._session: str | None = None
        self.messages: list[str] = []
        """Errors and warnings of the pages since the last `open`."""
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **values: Any) -> dict[str, Any]:
        """Send a command and wait for what it returns."""
        self._number += 1
        session = {"sessionId": self._session} if self._session else {}
        command = {"id": self._number, "method": method, "params": values, **session}
        os.write(self._sent, json.dumps(command).encode() + b"\0")
        while True:
            message = self._next()
            if message.get("id") == self._number:
                assert "error" not in message, message["error"]
                return message["result"]

    def _next(self) -> dict[str, Any]:
        while b"\0" not in self._rest:
            more = os.read(self._received, 1 << 20)
            assert more, "the browser has gone"
            self._rest += more
        whole, self._rest = self._rest.split(b"\0", 1)
        message = json.loads(whole)
        values = message.get("params", {})
        match message.get("method"):
            case "Runtime.exceptionThrown":
                self.messages.append(str(values["exceptionDetails"]))
            case "Runtime.consoleAPICalled" if values["type"] in ("error", "warning", "assert"):
                self.messages.append(str(values["args"]))
            case "Log.entryAdded" if values["entry"]["level"] in ("error", "warning"):
                self.messages.append(values["entry"]["text"])
        return message

    def open(self, address: str, *, width: int, scheme: str, ready: str = "true") -> None:
        """Open a page at a width [px] in a colour scheme, and wait until an expression holds in it."""
        self.messages.clear()
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=width < 600)  # fmt: skip
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
        self.call("Page.navigate", url=address)
        self.ask(
            "new Promise((done, fail) => { const end = Date.now() + 60000; const look = () => "
            f"document.readyState === 'complete' && ({ready}) ? done() : Date.now() > end ? fail('never ready') : setTimeout(look, 20);"
            " look(); })"
        )

    def ask(self, expression: str) -> Any:
        """Value of an expression in the page, awaited."""
        found = self.call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def picture(self, path: Path, *, whole: bool = False) -> None:
        """Save what is seen, or the whole page."""
        found = self.call("Page.captureScreenshot", captureBeyondViewport=whole)
        path.write_bytes(base64.b64decode(found["data"]))


@contextlib.contextmanager
def browser() -> Iterator[Browser]:
    """A headless Chromium, ended afterwards."""
    assert CHROMIUM is not None
    (command, sent), (received, answer) = os.pipe(), os.pipe()

    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        options = (
            "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-extensions", "--no-first-run", "--hide-scrollbars",
            "--remote-debugging-pipe", f"--user-data-dir={profile}",
        )  # fmt: skip
        # Chromium reads commands from descriptor 3 and answers on 4
        process = subprocess.Popen(
            ["bash", "-c", f'exec "$@" 3<&{command} 4>&{answer}', "chromium", CHROMIUM, *options],
            pass_fds=(command, answer), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        os.close(command)
        os.close(answer)
        try:
            yield Browser(sent, received)
        finally:
            process.terminate()
            process.wait(timeout=20)
            os.close(sent)
            os.close(received)


def too_wide(tab: Browser) -> list[str]:
    """What reaches beyond the page's right edge, and is not inside something that scrolls of itself."""
    return tab.ask("""(() => {
      const wide = document.documentElement.clientWidth + 1;
      const scrolls = (e) => e && e !== document.body && e !== document.documentElement
        && (["auto", "scroll", "hidden"].includes(getComputedStyle(e).overflowX) || scrolls(e.parentElement));
      const found = document.documentElement.scrollWidth > wide ? ["the page itself scrolls sideways"] : [];
      for (const e of document.querySelectorAll("body *")) {
        const box = e.getBoundingClientRect();
        if (box.width > 0 && box.right > wide && !scrolls(e.parentElement)) found.push(e.outerHTML.slice(0, 120));
      }
      return found;
    })()""")


def overlapping(tab: Browser) -> list[str]:
    """Legends of plots over which the tools of that plot, or of another, appear."""
    return tab.ask("""(() => {
      const boxes = (what) => [...document.querySelectorAll(what)].map((e) => e.getBoundingClientRect()).filter((b) => b.width > 0);
      const found = [];
      for (const a of boxes(".plot .legend")) for (const b of boxes(".plot .modebar")) {
        if (a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom)
          found.push(`legend ${Math.round(a.left)} to ${Math.round(a.right)}, tools ${Math.round(b.left)} to ${Math.round(b.right)}`);
      }
      return found;
    })()""")


def shown_whole(page: Path) -> None:
    """Assert that a page of plots is drawn without an error, and nothing of it cut, at every width and in every scheme."""
    with browser() as tab:
        for width in WIDTHS:
            for scheme in SCHEMES:
                tab.open(
                    page.as_uri(),
                    width=width,
                    scheme=scheme,
                    ready="document.documentElement.dataset.drawn > 0",
                )
                where = f"{width} px, {scheme}"
                assert not tab.messages, where
                assert not too_wide(tab), where
                assert not overlapping(tab), where
                assert tab.ask("document.querySelectorAll('.plot:not(:has(.svg-container))').length") == 0, (
                    where
                )
                ink, paper = tab.ask(
                    "[getComputedStyle(document.body).color, getComputedStyle(document.body).backgroundColor]"
                )
                assert (brightness(ink) < brightness(paper)) == (scheme == "light"), where
                assert tab.ask("getComputedStyle(document.querySelector('.plot .xtick text')).fill") == ink, (
                    where
                )


def brightness(colour: str) -> float:
    """Sum of the channels of a CSS colour ``rgb(r, g, b)``."""
    return sum(float(c) for c in re.findall(r"[\d.]+", colour)[:3])
