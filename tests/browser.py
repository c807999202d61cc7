"""Headless Chromium with software WebGL, or without any; tests of reports open pages in it."""

import importlib.util
import os
import shutil
import time

import pytest

_ALWAYS = ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--no-first-run")
_SOFTWARE = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")
_WAIT = 20.0  # seconds
_DRAWN = "document.body.dataset.drawn && document.body.dataset.busy !== 'true'"


def needs_browser():
    """Skip where the browser or its driver is missing, but not in CI."""
    missing = [each for each in ("chromium", "chromedriver") if shutil.which(each) is None]
    missing += ["selenium"] if importlib.util.find_spec("selenium") is None else []
    if missing and os.environ.get("CI") == "true":
        pytest.fail(f"{', '.join(missing)} missing, and CI installs them")
    if missing:
        pytest.skip(f"needs {', '.join(missing)}")


class Browser:
    """A window of Chromium on a page of a file."""

    def __init__(self, downloads, *, webgl=True):
        needs_browser()
        from selenium import webdriver
        from selenium.webdriver.chrome.service import Service

        options = webdriver.ChromeOptions()
        options.binary_location = shutil.which("chromium")
        for each in (*_ALWAYS, *(_SOFTWARE if webgl else ("--disable-3d-apis", "--disable-gpu"))):
            options.add_argument(each)
        logs = {"browser": "ALL", "performance": "ALL"}
        options.set_capability("goog:loggingPrefs", logs)
        service = Service(shutil.which("chromedriver"))
        self.driver = webdriver.Chrome(options=options, service=service)
        self.driver.set_page_load_timeout(_WAIT)
        self.driver.set_script_timeout(_WAIT)
        self.downloads = downloads
        where = {"behavior": "allow", "downloadPath": str(downloads)}
        self.driver.execute_cdp_cmd("Browser.setDownloadBehavior", where)

    def open(self, path, hash_="", *, width=1600, dark=False):
        """Open a page at a width of the window, and wait until it is drawn."""
        size = {"width": width, "height": 1000, "deviceScaleFactor": 1, "mobile": False}
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        theme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [theme]})
        self.driver.get("about:blank")
        self.log("browser"), self.log("performance")
        self.driver.get(f"file://{path}{hash_}")
        self.wait()
        return self

    def js(self, code, *arguments):
        """Run code in the page."""
        return self.driver.execute_script(code, *arguments)

    def log(self, kind):
        """What was logged since the last call."""
        return self.driver.get_log(kind)

    def wait(self, condition=_DRAWN):
        """Wait until a condition holds."""
        end = time.monotonic() + _WAIT
        while not self.js(f"return Boolean({condition})"):
            assert time.monotonic() < end, f"not true after {_WAIT} s: {condition}"
            time.sleep(0.02)

    def set(self, id_, value):
        """Give a control a value, as a user does, and wait for the page."""
        self.js(
            "const at = document.getElementById(arguments[0]); at.value = arguments[1];"
            "at.dispatchEvent(new Event('input', { bubbles: true }));",
            id_,
            value,
        )
        self.wait()

    def click(self, selector):
        """Click on an element, wherever the page is scrolled to."""
        self.js(
            "const at = document.querySelector(arguments[0]);"
            "at.dispatchEvent(new MouseEvent('click', { bubbles: true }));",
            selector,
        )
        self.wait()

    def key(self, key):
        """Press a key."""
        self.js(
            "document.body.dispatchEvent(new KeyboardEvent('keydown', { key: arguments[0], "
            "bubbles: true }))",
            key,
        )
        self.wait()

    def text(self, id_):
        """The text of an element."""
        return self.js("return document.getElementById(arguments[0]).textContent", id_)

    def download(self, what):
        """Press a button that downloads a picture, and return the file."""
        for old in self.downloads.iterdir():
            old.unlink()
        self.click(f"[data-download={what}]")
        end = time.monotonic() + _WAIT
        while not (found := list(self.downloads.glob("*.exr"))):
            assert time.monotonic() < end, "nothing was downloaded"
            time.sleep(0.02)
        return found[0]
