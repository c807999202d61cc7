"""Writes a report as one HTML file: templates, scripts and style are put into it.

A strict Content-Security-Policy allows the page's own script and style by their hashes, pictures
that scripts make, and nothing else: no network, no frames, no forms.
"""

import base64
import hashlib
import json
import re
from importlib.resources import files
from pathlib import Path
from typing import Any

from markupsafe import Markup

from sssfit.files import has_mark
from sssfit.messages import counted
from sssfit.report.charts import charts_of
from sssfit.report.record import Report
from sssfit.report.tables import tables_of

MARK = "sssfit.report/1"
# In the order of their imports: each file imports only from files before it.
SCRIPTS = (
    *("half", "colour", "figures", "exr", "passes", "state", "tables", "charts", "view"),
    *("fourier", "kernel", "truth"),
    *("model", "panel", "controls", "main"),
)
_IMPORT = re.compile(r"^import [^;]*;\n", re.MULTILINE)
_ROOM = "sssfit.report"


def page(report: Report) -> str:
    """Return a report as an HTML page."""
    return rendered(
        "page.html",
        script=script_text(),
        title=report.name,
        data=data_text(report.to_dict()),
        report=report,
        charts=charts_of(report),
        tables=tables_of(report),
        subtitle=_subtitle(report),
    )


def rendered(template: str, *, script: str, **values: Any) -> str:
    """Return a template filled, with its script, style and policy."""
    import jinja2  # .05 s that other verbs do not need

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader(_ROOM),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    style = _static("style.css")
    values |= {"mark": MARK, "policy": policy(script, style)}
    values |= {"script": Markup(script), "style": Markup(style)}
    return environment.get_template(template).render(**values)


def policy(script: str, style: str) -> str:
    """Return the Content-Security-Policy that lets this script and style run, and no other."""
    return "; ".join(
        (
            "default-src 'none'",
            f"script-src {_hash(script)}",
            f"style-src {_hash(style)}",
            "img-src data: blob:",
            "connect-src 'none'",
            "base-uri 'none'",
            "form-action 'none'",
        )
    )


def _hash(text: str) -> str:
    digest = hashlib.sha256(text.encode()).digest()
    return f"'sha256-{base64.b64encode(digest).decode('ascii')}'"


def script_text(names: tuple[str, ...] = SCRIPTS) -> str:
    """Return the modules as one script: their imports name functions that stand above."""
    parts = [_IMPORT.sub("", _static(f"{name}.js")) for name in names]
    return "\n".join(re.sub(r"^export ", "", each, flags=re.MULTILINE) for each in parts)


def data_text(data: dict[str, Any]) -> Markup:
    """Return data as JSON that cannot end the element it stands in."""
    text = json.dumps(data, allow_nan=False, ensure_ascii=True, separators=(",", ":"))
    for each in "<>&":
        text = text.replace(each, f"\\u{ord(each):04x}")
    return Markup(text)


def _static(name: str) -> str:
    return (files(_ROOM) / "static" / name).read_text(encoding="utf-8")


def _subtitle(report: Report) -> str:
    """Return what the page is about, in one line."""
    kernels = counted(len(report.kernels), "kernel")
    pictures = counted(len(report.pictures), "picture")
    pitch = report.comparison.mm_per_pixel
    return f"{kernels} for pixels of {pitch:g} mm, on {pictures}, beside the true picture."


def is_report_file(path: Path) -> bool:
    """Return whether a file is a page that we wrote."""
    return has_mark(path, {b"<!doctype html>": MARK.encode()})
