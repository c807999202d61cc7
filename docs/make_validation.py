"""Write docs/validation.md: figures of books and papers, and the program's values for them.

python docs/make_validation.py

The figures are those of tests/validation, one file a source. A minute on one core.
"""

import runpy
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))

from published import row_text  # noqa: E402
from sections import DOCS, marked_page  # noqa: E402

HEAD = """# Validation

Figures that books and papers print, and the program's values for them. Made by
`python docs/make_validation.py` from tests/validation, where each source is one file. In a row of
several numbers, the difference is the largest. Where a source prints a formula, the published value
is that formula by hand. A test fails if a value differs by more than half a unit of its last
printed digit, or than the row allows; walks may differ by up to 4.5 standard errors.
[verification.md](verification.md) has the walks at full size and comparisons with other programs.
"""

HEADS = "| place | figure | published | ours | difference |\n|---|---|---|---|---|"


def sources():
    """Yield the title, the path, the reference and the figures of each source."""
    for path in sorted((ROOT / "tests" / "validation").glob("test_*_[0-9]*.py")):
        found = runpy.run_path(str(path))
        yield found["TITLE"], path.relative_to(ROOT), found["SOURCE"], found["FIGURES"]


def page():
    """Return the page's text."""
    parts = [HEAD]
    for title, path, source, figures in sources():
        rows = "\n".join(row_text(each) for each in figures)
        parts.append(f"## {title}\n\n{source} (`{path}`).\n\n{HEADS}\n{rows}\n")
    return "\n".join(parts)


def main():
    """Write the page."""
    text = marked_page("docs/make_validation.py", page())
    (DOCS / "validation.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
