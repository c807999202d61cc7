"""Headless Chromium with software WebGL, or without any; tests of reports open pages in it."""

import importlib.util
import os
import shutil
import time

import pytest

_ALWAYS = ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--no-first-run")
# WebGL is drawn by software, but the page around it is not: three quarters of the time.
_SOFTWARE = (
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-gpu-compositing",
)
_WAIT = 20.0  # seconds
_MOVE = 50  # milliseconds; five times as long if nothing is said
# Puts a control beside a value; returns the direction to it (0 if it cannot go), and what it is.
_BESIDE = """const [control, value] = arguments, isList = control.tagName === 'SELECT';
const key = isList ? 'selectedIndex' : 'value', step = isList ? 1 : Number(control.step);
const goal = isList ? [...control.options].findIndex((at) => at.value === value) : Number(value);
if (isList && goal < 0) throw new Error(`there is no ${value}`);
const side = control.matches(':disabled') ? 0 : Math.sign(Math.round((goal - control[key]) / step));
if (side) control[key] = goal - side * step;
return [side, isList];"""
# Looks in the page: of each look from here the way took longer than what is waited for.
_WAITED = """const done = arguments[0], end = performance.now() + {ms};
const look = () => {{
  const holds = Boolean({condition});
  if (holds || performance.now() > end) done(holds);
  else setTimeout(look, 1);
}};
look();"""
_DRAWN = "document.body.dataset.drawn && document.body.dataset.busy !== 'true'"
# As where somebody edits the address, and also where it is the same.
_VIEW = """history.replaceState(null, '', location.pathname + arguments[0]);
window.dispatchEvent(new HashChangeEvent('hashchange'));"""


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
        self.driver.set_script_timeout(2.0 * _WAIT)
        self.downloads = downloads
        self.opened = None
        where = {"behavior": "allow", "downloadPath": str(downloads)}
        self.driver.execute_cdp_cmd("Browser.setDownloadBehavior", where)

    def open(self, path, hash_="", *, width=900, dark=False):
        """Open a page at a width of the window, and wait until it is drawn."""
        size = {"width": width, "height": 1000, "deviceScaleFactor": 1, "mobile": False}
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        # A page that still scrolls is clicked in the wrong place.
        given = {"prefers-color-scheme": "dark" if dark else "light"}
        given |= {"prefers-reduced-motion": "reduce"}
        features = [{"name": name, "value": value} for name, value in given.items()]
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})
        self.opened = None
        self.driver.get("about:blank")
        self.log("browser"), self.log("performance")
        self.driver.get(f"file://{path}{hash_}")
        self.wait()
        self.opened = path, width, dark
        return self

    def show(self, path, hash_=""):
        """Show a view of a page, which is opened only if it is not.

        What the address does not hold stays as it was: the order of tables, the panels of charts.
        """
        if self.opened != (path, 900, False):
            return self.open(path, hash_)
        self.js(_VIEW, hash_)
        self.wait()
        return self

    def js(self, code, *arguments):
        """Run code in the page."""
        return self.driver.execute_script(code, *arguments)

    def log(self, kind):
        """What was logged since the last call, but for what WebGL's driver says of its speed."""
        every = self.driver.get_log(kind)
        slow = "GL Driver Message (OpenGL, Performance"
        return [each for each in every if slow not in each["message"]]

    def wait(self, condition=_DRAWN):
        """Wait until a condition holds."""
        code = _WAITED.format(condition=condition, ms=1000.0 * _WAIT)
        holds = self.driver.execute_async_script(code)
        assert holds, f"not true after {_WAIT} s: {condition}"

    def set(self, id_, value):
        """Give a control a value by one press of a key, from the step beside it.

        It is put there without an event: the page would draw all steps between.
        """
        from selenium.webdriver import Keys

        control = self.driver.find_element("id", id_)
        side, is_list = self.js(_BESIDE, control, str(value))
        on, back = (
            (Keys.ARROW_DOWN, Keys.ARROW_UP) if is_list else (Keys.ARROW_RIGHT, Keys.ARROW_LEFT)
        )
        if side:
            control.send_keys(on if side > 0 else back)
        self.wait()

    def click(self, selector):
        """Click on an element, scrolled to the middle, where the status line does not lie."""
        self._seen(selector).click()
        self.wait()

    def _seen(self, selector):
        element = self.driver.find_element("css selector", selector)
        self.js("arguments[0].scrollIntoView({ block: 'center', behavior: 'instant' })", element)
        return element

    def point(self, selector, *, click=False):
        """Move the pointer onto an element, and click there."""
        mouse = self.mouse().move_to_element(self._seen(selector))
        (mouse.click() if click else mouse).perform()
        self.wait()

    def mouse(self):
        """What moves the pointer, in a few steps each."""
        from selenium.webdriver import ActionChains

        return ActionChains(self.driver, duration=_MOVE)

    def key(self, *keys):
        """Press keys while no control has the focus."""
        from selenium.webdriver import ActionChains

        self.js("document.activeElement.blur()")
        ActionChains(self.driver).send_keys(*keys).perform()
        self.wait()

    def pasted(self):
        """What the clipboard holds, by pasting it into a field."""
        from selenium.webdriver import ActionChains, Keys

        self.js(
            "window.field = document.createElement('textarea');"
            "document.body.append(window.field); window.field.focus();"
        )
        keys = ActionChains(self.driver).key_down(Keys.CONTROL).send_keys("v").key_up(Keys.CONTROL)
        keys.perform()
        return self.js("window.field.remove(); return window.field.value")

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
            time.sleep(0.005)
        return found[0]
