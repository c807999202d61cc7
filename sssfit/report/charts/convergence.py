"""The photon walk's error over its photons, beside the law of the square root."""

from markupsafe import Markup

from sssfit.report.charts.svg import Chart, Plot, limits
from sssfit.report.record import Report


def convergence_chart(report: Report) -> Chart | None:
    """Draw the error of F(r) of every walk, and the exact solution's estimate of its own."""
    found = report.convergence
    if found is None:
        return None
    photons = [float(each.photons) for each in found.walks]
    errors = [each.error for each in found.walks]
    own = found.resolutions[-1].estimate
    plot = Plot(
        limits(photons, is_log=True),
        limits([*errors, own], is_log=True),
        ("photons", "largest error of F(r)"),
        log=(True, True),
        describe="Error of photon walks over their number of photons",
    )
    ends = [min(photons), max(photons)]
    middle = found.line.at((ends[0] * ends[1]) ** 0.5)
    law = [float(middle * (end / (ends[0] * ends[1]) ** 0.5) ** -0.5) for end in ends]
    plot.curve(ends, law, "guess")
    plot.curve([plot.x.low, plot.x.high], [own, own], "m1")
    dot = Markup('<circle class="dot" cx="{:.1f}" cy="{:.1f}" r="4"/>')
    for x, y in zip(photons, errors, strict=True):
        plot.add(dot.format(plot.x.place(x), plot.y.place(y)))
    legend = (
        ("dot-point", "a walk, with a seed of its own"),
        ("guess", "photons to the power -1/2"),
        ("m1", "the exact solution's estimate of its own error"),
    )
    note = (
        "As a share of the total, of the worst channel, against the exact solution. The slope of "
        "the walks is "
        f"{found.line.slope:.2f} ± {found.line.slope_stderr:.2f}; in theory it is -0.5."
    )
    return Chart("convergence", "Convergence", note, legend, (("", plot.svg()),))
