"""Where the scripts of this folder put what they make, with the date and the command of its making.

    <!-- made by docs/make_cost.py, 2026-11-27: python docs/make_cost.py -->
    ...
    <!-- end of docs/make_cost.py -->

``tests/test_docs_tables.py`` asks this of every table, or the name of a test that recomputes it:

    <!-- held by tests/test_docs_tables.py::test_names_are_in_the_program -->
"""

import datetime
import re
from pathlib import Path

DOCS = Path(__file__).parent


def put_section(page, script, text, command=None):
    """Write a section into its place in a page of this folder, or at the page's end.

    ``script`` names the place: the script's path, and a word behind it where it has several. The
    command is ``python SCRIPT`` unless given.
    """
    path = DOCS / page
    old = path.read_text(encoding="utf-8")
    new = f"{start(script, command)}\n\n{text.strip()}\n\n{end(script)}"
    place = re.compile(
        rf"<!-- made by {re.escape(script)}, .*?-->.*?{re.escape(end(script))}", re.DOTALL
    )
    if not place.search(old):
        path.write_text(f"{old.rstrip()}\n\n{new}\n", encoding="utf-8")
        return
    path.write_text(place.sub(lambda _: new, old, count=1), encoding="utf-8")


def marked_page(script, text, command=None):
    """Return a page that is made as a whole."""
    return f"{start(script, command)}\n\n{text.strip()}\n\n{end(script)}\n"


def start(script, command=None):
    """Return what stands before what a script makes today."""
    today = datetime.date.today().isoformat()
    return f"<!-- made by {script}, {today}: {command or f'python {script}'} -->"


def end(script):
    """Return what stands behind it."""
    return f"<!-- end of {script} -->"
