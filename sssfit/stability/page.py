"""One Markdown page of several materials: a section with the table and the chart of each."""

from collections.abc import Iterable

from sssfit.stability.record import MARK, Stability

_SECTION = """## {material}

Pixels of {pitch:g} mm, exact profile, seed {seed}. A place is followed by its uncertainty.

{table}

[![Where fits of {material} are safe]({chart})]({chart})
"""


def section(found: Stability, chart: str) -> str:
    """Return one material's section; ``chart`` is where its chart lies, from the page's folder."""
    table = found.table().removeprefix(MARK).strip()
    text = _SECTION.format(
        material=found.material,
        pitch=found.mm_per_pixel,
        seed=found.seed,
        table=table,
        chart=chart,
    )
    return "\n".join([text, *(f"{each}\n" for each in found.notes)])


def page(materials: Iterable[Stability]) -> str:
    """Return the page, whose charts are those that `chart_name` names, beside it."""
    sections = [section(each, chart_name(each.material)) for each in materials]
    return "\n".join([f"{MARK}\n\n# Where fits are safe\n", *sections])


def chart_name(material: str) -> str:
    """Return the name of a material's chart."""
    return f"{material}-stability.png"
