"""docs/validation.md has every figure of every source, and no other."""

import re
import runpy
from pathlib import Path

from published import PAGE, cells

ROOT = Path(__file__).parents[2]


def test_the_page_has_the_figures_of_all_sources():
    made = runpy.run_path(str(ROOT / "docs" / "make_validation.py"))
    text = PAGE.read_text(encoding="utf-8")
    rows = [re.split(r"(?<!\\)\|", line) for line in text.splitlines() if line.startswith("| ")]
    found = [[cell.strip() for cell in row[1:4]] for row in rows if row[1].strip() != "place"]
    sources = list(made["sources"]())
    assert len(sources) >= 12
    assert found == [cells(each) for *_, figures in sources for each in figures], (
        "run: python docs/make_validation.py"
    )
    for title, _, source, _ in sources:
        assert f"## {title}\n\n{source} (" in text
