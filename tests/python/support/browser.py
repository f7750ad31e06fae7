"""A headless Chromium on two pipes (DevTools protocol): no driver to install. `Browser.path()` is None where there is none."""

from __future__ import annotations

import base64
import contextlib
import json
import os
import select
import shutil
import signal
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

__all__ = ["Browser"]

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
ARGUMENTS = ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars", "--no-first-run",
             "--disable-extensions", "--disable-background-networking", "--remote-debugging-pipe", "about:blank")  # fmt: skip
PATIENCE = 60.0  # s for one answer


class Browser:
    """One browser with one page; messages of its console that are errors gather in `errors`, requests in `requests`."""

    @staticmethod
    def path() -> str | None:
        """The program: GAIDENT_CHROMIUM, or the first known name on the path."""
        return os.environ.get("GAIDENT_CHROMIUM") or next((p for p in map(shutil.which, NAMES) if p), None)

    def __init__(self, program: str) -> None:
        self.profile = tempfile.TemporaryDirectory(prefix="chromium", ignore_cleanup_errors=True)
        down, self.to = os.pipe()
        self.back, up = os.pipe()
        # The browser reads commands from its file 3 and answers on its file 4. Beyond 9 first: neither may be 3 or 4 itself.
        moved = [os.dup2(fd, 90 + i, inheritable=True) for i, fd in enumerate((down, up))]
        actions = [(os.POSIX_SPAWN_DUP2, moved[0], 3), (os.POSIX_SPAWN_DUP2, moved[1], 4)]
        actions += [(os.POSIX_SPAWN_OPEN, 2, os.devnull, os.O_WRONLY, 0)]
        arguments = [program, f"--user-data-dir={self.profile.name}", *ARGUMENTS]
        self.pid = os.posix_spawn(program, arguments, os.environ, file_actions=actions, setpgroup=0)
        for fd in (down, up, *moved):
            os.close(fd)
        self.rest, self.last = b"", 0
        self.errors: list[str] = []
        self.requests: list[str] = []
        try:
            self._begin()
        except BaseException:
            self.close()
            raise

    session: str | None = None

    def _begin(self) -> None:
        target = self.ask("Target.createTarget", session=None, url="about:blank")["targetId"]
        self.session = self.ask("Target.attachToTarget", session=None, targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.ask(f"{domain}.enable")

    def ask(self, method: str, *, session: str | None = "", **parameters: Any) -> dict[str, Any]:
        """One command and its answer."""
        self.last += 1
        message: dict[str, Any] = {"id": self.last, "method": method, "params": parameters}
        if session is not None:
            message["sessionId"] = self.session
        os.write(self.to, json.dumps(message).encode() + b"\0")
        found: dict[str, Any] = self._until(lambda m: m.get("id") == message["id"])
        assert "error" not in found, f"{method}: {found['error']}"
        result: dict[str, Any] = found["result"]
        return result

    def open(self, page: Path) -> None:
        """Loads a file; returns once it is loaded."""
        self.errors.clear()
        self.requests.clear()
        self.ask("Page.navigate", url=page.as_uri())
        self._until(lambda m: m.get("method") == "Page.loadEventFired")

    def run(self, script: str) -> Any:
        """The value of a JavaScript expression, of a promise when it is fulfilled."""
        answer = self.ask("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, f"{script}: {answer['exceptionDetails']}"
        return answer["result"].get("value")

    def wait(self, condition: str, seconds: float = 20.0) -> None:
        """Until a JavaScript expression is true."""
        end = time.monotonic() + seconds
        while not self.run(condition):
            assert time.monotonic() < end, f"never true: {condition}"
            time.sleep(0.02)

    def size(self, width: int, height: int, phone: bool = False) -> None:
        self.ask("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=phone)

    def prefers(self, scheme: str) -> None:
        """What prefers-color-scheme says: "light" or "dark"."""
        self.ask("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])

    def drag(self, x0: float, y0: float, x1: float, y1: float) -> None:
        """With the left button down, in pixels of the window."""
        steps = [("mouseMoved", x0, y0), ("mousePressed", x0, y0), ("mouseMoved", (x0 + x1) / 2, (y0 + y1) / 2),
                 ("mouseMoved", x1, y1), ("mouseReleased", x1, y1)]  # fmt: skip
        for kind, x, y in steps:
            down = kind != "mouseMoved" or (x, y) != (x0, y0)
            self.ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, clickCount=1, buttons=int(down),
                     button="left" if down else "none")  # fmt: skip

    def downloads_to(self, folder: Path) -> None:
        self.ask("Browser.setDownloadBehavior", session=None, behavior="allow", downloadPath=str(folder))

    def picture(self, whole: bool = True) -> bytes:
        """PNG of the page, the whole or what is in the window."""
        return base64.b64decode(self.ask("Page.captureScreenshot", captureBeyondViewport=whole)["data"])

    def pdf(self) -> bytes:
        """The page as it prints."""
        return base64.b64decode(self.ask("Page.printToPDF", preferCSSPageSize=True)["data"])

    def close(self) -> None:
        """Ends the browser that this object began, with its helpers: they form a group of their own."""
        for fd in (self.to, self.back):
            os.close(fd)
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.pid, signal.SIGKILL)
        os.waitpid(self.pid, 0)
        self.profile.cleanup()

    def _until(self, wanted: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        end = time.monotonic() + PATIENCE
        while True:
            *messages, self.rest = self.rest.split(b"\0")
            for i, text in enumerate(messages):
                message = json.loads(text)
                self._note(message)
                if wanted(message):
                    self.rest = b"\0".join([*messages[i + 1 :], self.rest])
                    return dict(message)
            ready, _, _ = select.select([self.back], [], [], max(0.0, end - time.monotonic()))
            assert ready, "the browser does not answer"
            block = os.read(self.back, 1 << 20)
            assert block, "the browser has ended"
            self.rest += block

    def _note(self, message: dict[str, Any]) -> None:
        method, parameters = message.get("method"), message.get("params", {})
        if method == "Runtime.exceptionThrown":
            self.errors.append(str(parameters["exceptionDetails"]))
        elif method == "Runtime.consoleAPICalled" and parameters["type"] in ("error", "warning", "assert"):
            self.errors.append(str([a.get("value", a.get("description")) for a in parameters["args"]]))
        elif method == "Log.entryAdded" and parameters["entry"]["level"] in ("error", "warning"):
            self.errors.append(str(parameters["entry"]["text"]))
        elif method == "Network.requestWillBeSent":
            self.requests.append(parameters["request"]["url"])
