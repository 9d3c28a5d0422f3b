"""A headless Chromium, driven by its own protocol: nothing but tornado, which Panel brings."""

import asyncio
import base64
import json
import os
import shutil
import subprocess
import tempfile
import time
from pathlib import Path

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")


def program():
    """Path of a browser, or None."""
    return next(filter(None, map(shutil.which, NAMES)), None)


class Browser:
    """One tab; a context manager."""

    def __enter__(self):
        self.folder = Path(tempfile.mkdtemp())
        options = ["--headless=new", "--remote-debugging-port=0", "--disable-gpu"]
        if hasattr(os, "geteuid") and os.geteuid() == 0:
            options.append("--no-sandbox")  # it refuses to run as root otherwise
        options += [f"--user-data-dir={self.folder}", "--force-device-scale-factor=1"]
        self.process = subprocess.Popen(
            [program(), *options, "about:blank"], stderr=subprocess.DEVNULL
        )
        self.loop = asyncio.new_event_loop()
        self.number, self.socket = 0, self.loop.run_until_complete(self._connect())
        self("Page.enable")
        self("Runtime.enable")
        return self

    def __exit__(self, *_):
        self.socket.close()
        self.process.terminate()
        self.process.wait(20)
        self.loop.run_until_complete(asyncio.sleep(0))
        self.loop.close()
        shutil.rmtree(self.folder, ignore_errors=True)

    async def _connect(self):
        from tornado.httpclient import AsyncHTTPClient
        from tornado.websocket import websocket_connect

        port = self.folder / "DevToolsActivePort"
        for _ in range(300):
            if port.exists() and port.read_text().strip():
                break
            await asyncio.sleep(0.1)
        number = port.read_text().split()[0]
        for _ in range(100):
            found = await AsyncHTTPClient().fetch(f"http://127.0.0.1:{number}/json")
            pages = [one for one in json.loads(found.body) if one["type"] == "page"]
            if pages:
                break
            await asyncio.sleep(0.1)
        return await websocket_connect(pages[0]["webSocketDebuggerUrl"], max_message_size=2**28)

    def __call__(self, method, **parameters):
        """Send one message, return its result."""
        return self.loop.run_until_complete(self._send(method, parameters))

    async def _send(self, method, parameters):
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        await self.socket.write_message(json.dumps(message))
        while True:
            answer = json.loads(await self.socket.read_message())
            if answer.get("id") == message["id"]:
                assert "error" not in answer, answer["error"]
                return answer["result"]

    def size(self, width, height=900):
        self(
            "Emulation.setDeviceMetricsOverride",
            width=width, height=height, deviceScaleFactor=1, mobile=False,
        )  # fmt: skip

    def open(self, address):
        self("Page.navigate", url=address)
        self.until("document.readyState == 'complete'")

    def ask(self, expression):
        """The value of an expression on the page."""
        found = self("Runtime.evaluate", expression=expression, returnByValue=True)
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def until(self, expression, seconds=60.0):
        """Wait until an expression is true, and return it."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            value = self.ask(expression)
            if value:
                return value
            time.sleep(0.02)
        raise TimeoutError(expression)

    def picture(self):
        """What the window shows, as PNG."""
        return base64.b64decode(self("Page.captureScreenshot", format="png")["data"])

    def drag(self, place, dx):
        """Press the mouse at a place, move it by dx, and let it go."""
        x, y = place
        for kind, at in (
            ("mousePressed", x),
            ("mouseMoved", x + dx / 2),
            ("mouseMoved", x + dx),
            ("mouseReleased", x + dx),
        ):
            self(
                "Input.dispatchMouseEvent",
                type=kind, x=at, y=y, button="left", buttons=1, clickCount=1,
            )  # fmt: skip
