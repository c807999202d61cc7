"""What every verb prints, line by line, in terms of its JSON object: see ``printed``."""

import json
from collections.abc import Callable, Sequence
from typing import Any

from printed import Exact, Percent, Rough, Table, Words

Figures = dict[str, Any]
Layout = Callable[[Figures], list[Any]]


def by_channel(figures: Figures, keys: Sequence[str]) -> list[list[Any]]:
    """A row a channel: its name, and of each key its value."""
    return [
        [name, *(figures[key] and figures[key][c] for key in keys)]
        for c, name in enumerate(figures["channels"])
    ]


def wrote(figures: Figures) -> Words:
    return Words("Wrote {}", ", ".join(figures["output"]))


def widest(values: Sequence[float]) -> float:
    """The one that is furthest from 0."""
    return max(values, key=abs)


def plural(count: int, word: str) -> str:
    return word + ("es" if word.endswith("s") else "s") * (count > 1)


# materials


def materials_list(f: Figures) -> list[Any]:
    heads = [
        "name",
        "eta",
        "scattering albedo R G B",
        "transport MFP R G B, mm",
        "dr, mm",
        "annuli",
    ]
    rows = [
        [
            row["name"],
            row["eta"],
            Words("{} {} {}", *row["albedo"]),
            Words("{} {} {}", *row["mean_free_path_mm"]),
            row["dr_mm"],
            row["annuli"],
            row["radius_mm"],
        ]
        for row in f["rows"]
    ]
    layered = [
        [
            row["name"],
            " ".join(f"{eta:g}" for eta in row["eta"]),
            " ".join("inf" if each is None else f"{each:g}" for each in row["thickness_mm"]),
            row["source"],
        ]
        for row in f["layered"]
    ]
    return [
        Table([*heads, "radius, mm"], rows),
        Table(["layers", "eta", "thickness, mm", "source"], layered),
        Words(
            "{}: a profile without coefficients, for simulate, compare, choose, motion and report",
            *f["profiles"],
        ),
    ]


def one_material(f: Figures) -> list[Any]:
    if f["dr_mm"] is None:
        grid = "none: too many annuli, give simulate a --dr or --radius"
    else:
        grid = Words("dr {} mm, {} annuli, radius {} mm", f["dr_mm"], f["annuli"], f["radius_mm"])
    parts: list[Any] = [
        Words("name                  {}", f["name"]),
        Words("source                {}", f["source"] or "not given"),
        Words("specular reflectance  {}", f["specular_reflectance"]),
        Words("paper's grid          {}", grid),
        Words("sha256                {}", f["sha256"]),
    ]
    parts += [] if f["eta_above"] == 1 else [Words("above: eta {}", f["eta_above"])]
    for number, layer in enumerate(f["layers"], 1):
        thickness = layer["thickness_mm"]
        what = "semi-infinite" if thickness is None else Words("{} mm thick", thickness)
        which = f"layer {number}: " if len(f["layers"]) > 1 else ""
        keys = ("sigma_a_per_mm", "sigma_s_per_mm", "g", "albedo", "mean_free_path_mm")
        heads = ["channel", "sigma_a, 1/mm", "sigma_s, 1/mm", "g", "single-scattering albedo"]
        heads += ["transport mean free path, mm"]
        rows = by_channel({**layer, "channels": f["channels"]}, keys)
        parts += [Words(which + "{}, eta {}", what, layer["eta"]), Table(heads, rows, alike=("g",))]
    if any(any(layer["g"]) for layer in f["layers"]):
        parts.append(Words("transport mean free path: 1 / (sigma_a + (1 - g) sigma_s)"))
    return parts + ([] if f["eta_below"] == 1 else [Words("below: eta {}", f["eta_below"])])


def six_gaussians(f: Figures) -> list[Any]:
    rows = [
        [variance, *weights]
        for variance, weights in zip(f["variances_mm2"], f["weights"], strict=True)
    ]
    return [
        Words("name      {}", f["name"]),
        Words("source    {}", f["source"]),
        Words(
            "six Gaussians in place of coefficients: sssfit simulate deon-skin makes their profile"
        ),
        Table(["variance, mm^2", *f["channels"]], rows),
    ]


def inversion(f: Figures) -> list[Any]:
    what, heads, keys = "diffuse reflectance", ["diffuse reflectance"], ["reflectance"]
    if f["light"] == "diffuse":
        what = "base colour"
        heads, keys = [what, "normal reflectance"], [*keys, "reflectance_normal"]
    heads = ["channel", *heads, "albedo", "sigma_a, 1/mm", "sigma_s, 1/mm"]
    keys += ["albedo", "sigma_a_per_mm", "sigma_s_per_mm"]
    published = [f["approximations"][key] for key in ("chiang2016", "van_de_hulst")]
    rows = [
        [
            name,
            *(
                Words(
                    "{}, {} ({} %)",
                    each["albedo"][c],
                    each["reflectance"][c],
                    100.0 * (each["reflectance"][c] / f["reflectance_asked"][c] - 1.0),
                )
                for each in published
            ),
        ]
        for c, name in enumerate(f["channels"])
    ]
    # What could be reflected is cut off and not rounded: nobody may ask for more than is printed.
    most = int(1e6 * f["largest_reflectance"]) / 1e6
    return [
        Words(
            "{}: eta {}, could reflect up to {} under {} light",
            *(f["name"], f["eta"], most, f["light"]),
        ),
        Table(heads, by_channel(f, keys)),
        Words(f"approximate albedos, the {what} they really have, and its error:"),
        Table(["channel", "Chiang et al. 2016, gives", "van de Hulst, gives"], rows),
        wrote(f),
    ]


# simulate


def simulation(f: Figures) -> list[Any]:
    rows = f.get("rows") or [f]
    return [
        _heading(f, rows),
        _energies(rows),
        *_absorbed(rows),
        *_balance(rows),
        *_beyond(rows),
        *_target(rows),
        _ended(f, rows),
    ]


def _heading(f: Figures, rows: list[Figures]) -> Words:
    if "rows" in f and not rows[0]["photons"]:
        worst = max(rows, key=lambda row: row["relative_error"])
        return Words("{} materials: {}", len(rows), _how(worst))
    if "rows" in f:
        counts = sorted({row["photons"] for row in rows})
        how = Words(
            " to ".join("{}" for _ in counts) + " photons, seed {}", *counts, rows[0]["seed"]
        )
        return Words("{} materials: {}", len(rows), how)
    how = _how(f)
    if f["seconds"] is not None:
        how = Words("{}, {} s", how, Rough(f["seconds"]))
    if f["photons"] and f["seconds"]:
        how = Words("{} ({} a second)", how, Rough(f["photons_per_second"]))
    grid = Words("{} annuli of {} mm, to {} mm", f["annuli"], f["dr_mm"], f["annuli"] * f["dr_mm"])
    return Words("{}: {}; {}", f["material"], how, grid)


def _how(row: Figures) -> Words:
    if row["photons"]:
        return Words("{} photons, seed {}", row["photons"], row["seed"])
    if row["method"] == "exact":
        error = Rough(100.0 * row["relative_error"])
        if row["solver"] == "half-space":
            return Words("exact (half-space solver) to {} % of the total", error)
        return Words(
            "exact (layer solver, {} directions) to {} % of the total", row["directions"], error
        )
    if "mapping" in row:
        return Words("{} ({})", row["method"], row["mapping"])
    return Words("{}", row["method"])


def _energies(rows: list[Figures]) -> Table:
    is_slab = any(row["transmittance"] is not None for row in rows)
    error = "std. error" if rows[0]["photons"] else "est. error"
    heads = ["channel", "diffuse reflectance", error]
    heads += ["transmittance", error] if is_slab else []
    keys = ["diffuse_reflectance", "diffuse_reflectance_stderr"]
    keys += ["transmittance", "transmittance_stderr"] if is_slab else []
    keys += ["absorbed", "beyond_grid"]
    cells = [
        [name if len(rows) == 1 else f"{row['material']} {name}", *values]
        for row in rows
        for name, *values in by_channel(row, keys)
    ]
    return Table([*heads, "absorbed", "beyond grid"], cells)


def _absorbed(rows: list[Figures]) -> list[Words]:
    return [
        Words(
            "absorbed by layer, {} {}: " + ", ".join("{}" for _ in row["absorbed_by_layer"]),
            row["material"],
            name,
            *(layer[c] for layer in row["absorbed_by_layer"]),
        )
        for row in rows
        for c, name in enumerate(row["channels"])
        if row["absorbed_by_layer"] is not None and len(row["absorbed_by_layer"]) > 1
    ]


def _balance(rows: list[Figures]) -> list[Words]:
    lines = [] if len(rows) > 1 else [_specular(rows[0])]
    if any(row["energy_balance_stderr"] is None for row in rows):
        return lines
    each = [
        (balance, stderr, f"{row['material']} {name}")
        for row in rows
        for balance, stderr, name in zip(
            row["energy_balance"], row["energy_balance_stderr"], row["channels"], strict=True
        )
    ]
    parts = "specular + diffuse + absorbed"
    parts += " + transmitted" if any(row["transmittance"] is not None for row in rows) else ""
    unfinished = max(value for row in rows for value in row["unfinished"])
    parts += " + unfinished" if unfinished else ""
    balance, stderr, name = max(
        each, key=lambda one: max(abs(one[0]) - 1e-12, 0.0) / (4.5 * one[1] + 1e-12)
    )
    if not rows[0]["photons"]:
        words = Words("energy: {} = 1 to {} (worst channel, {})", parts, Rough(abs(balance)), name)
        return [*lines, words]
    within = "within" if abs(balance) <= 4.5 * stderr + 1e-12 else "NOT WITHIN"
    words = Words(
        "energy: {} = 1 {} the run's own error: {}, standard error {} (worst channel, {})",
        *(parts, within, balance, Rough(max(stderr, 1e-12)), name),
    )
    lines.append(words)
    return lines + ([Words("unfinished, at most: {}", unfinished)] if unfinished else [])


def _specular(row: Figures) -> Words:
    return Words("specular reflectance {}", row["specular_reflectance"])


def _beyond(rows: list[Figures]) -> list[Words]:
    lost = [
        (f"{row['material']} {name}", beyond / total)
        for row in rows
        for name, beyond, total in by_channel(row, ("beyond_grid", "diffuse_reflectance"))
        if beyond / total > 1e-3
    ]
    if not lost:
        return []
    remedy = " (--radius auto)" if rows[0]["photons"] else " (--radius)"
    template = "beyond the grid, as a share of diffuse: " + ", ".join("{} {}" for _ in lost)
    values = [value for name, share in lost for value in (name, Percent(share))]
    return [Words(template + remedy, *values)]


def _target(rows: list[Figures]) -> list[Words]:
    target = rows[0]["target_error"]
    if target is None:
        return []
    reached = max(row["relative_error"] for row in rows)
    photons = list(dict.fromkeys(row["photons"] for row in rows))
    counts = Words(" and ".join("{}" for _ in photons), *photons)
    return [
        Words(
            "target error {} of F at the last edge: {} with {} photons, {} reached",
            *(Percent(target), "met" if reached < target else "NOT MET", counts, Percent(reached)),
        )
    ]


def _ended(f: Figures, rows: list[Figures]) -> Words:
    if rows[0]["finished_before"]:
        return Words("Finished before, nothing to do: {}", *f["output"])
    return wrote(f)


# fit


def fit(f: Figures) -> list[Any]:
    heads = ["channel", "Frobenius error", "energy error", "energy", "ended"]
    rows = [
        [name, Percent(frobenius), Percent(energy_error), energy, stop]
        for name, frobenius, energy_error, energy, stop in by_channel(
            f, ("relative_frobenius_error", "energy_error", "energy", "stop_reason")
        )
    ]
    return [
        Words(
            f"{{}}: {{}}, {{}} {plural(f['rank'], 'term')}, {{}} {plural(f['pixels'], 'pixel')} of "
            "{} mm, {} s",
            *(f["material"], f["method"], f["rank"], f["pixels"], f["mm_per_pixel"]),
            Rough(f["seconds"]),
        ),
        Table(heads, rows, alike=("ended",)),
        wrote(f),
    ]


# render


def rendering(f: Figures) -> list[Any]:
    how = Words("{} borders", f["border"])
    if f["intermediate"]:
        how = Words("{}, {} between passes", how, f["intermediate"])
    if f["follow"]:
        how = Words("screen space, follow {}, {}", f["follow"], how)
    parts: list[Any] = [
        Words(
            "{}: {} x {} pixels of {} mm, {}; {}",
            *(f["irradiance"], f["width"], f["height"], f["mm_per_pixel"], how, f["kernel"]),
        ),
        Words(
            "cost: {} weights and {} bytes moved a pixel in {} passes, {} bytes stored, {} s a "
            "megapixel",
            *(f["fetches"], f["bytes_per_pixel"], f["passes"]),
            *(f["kernel_bytes"], f["seconds_per_megapixel"]),
        ),
    ]
    if f["transmitted_maximum"] is not None:
        most = by_channel(f, ["transmitted_maximum"])
        words = "through the object at most: " + ", ".join("{} {}" for _ in most)
        values = [value for pair in most for value in pair]
        parts.append(Words(words + ", face on the key light is 1", *values))
    lost = _lost(f) if f["rmse"] is not None else []
    return [*parts, *lost, *_difference(f), wrote(f)]


def _difference(f: Figures) -> list[Any]:
    if f["difference_gain"] is None:
        return []
    end, what = f["difference_end"], f["difference_of"]
    if f["difference_map"] is None:
        return [Words("difference: absolute, {} times", f["difference_gain"])]
    if f["difference_map"] == "signed":
        words = "difference map: {}, blue -{}, white 0, red {}"
        return [Words(words, what, end, end)]
    return [Words("difference map: {}, violet 0, green to yellow {}", what, end)]


def _lost(f: Figures) -> list[Any]:
    colours = Words(
        "Delta E 2000 mean {}, 95th percentile {}, 99th {}, {} of pixels above 1, at exposure {}",
        *(f["delta_e_2000_mean"], f["delta_e_2000_p95"], f["delta_e_2000_p99"]),
        *(f["share_above_1"] is not None and Percent(f["share_above_1"]), f["exposure"]),
    )
    if f["delta_e_2000_mean"] is None:
        colours = Words("no Delta E: {} channels are no colour", len(f["channels"]))
    structure = [Words("SSIM {}, FLIP {}", f["ssim"], f["flip"])] if f["ssim"] is not None else []
    rows = [
        [name, Percent(drift), *both]
        for name, drift, *both in by_channel(
            f, ("energy_drift", "radial_asymmetry", "true_radial_asymmetry")
        )
    ]
    return [
        Words("against the 2D kernel of {}:", f["profile"]),
        colours,
        Words(
            "relative L2 {}, RMSE {}, largest {}, PSNR {} dB",
            *(Percent(f["relative_l2"]), f["rmse"], f["maximum"], f["psnr_db"]),
        ),
        *structure,
        Table(["channel", "energy drift", "radial asymmetry", "of the true kernel"], rows),
    ]


# compare

COSTS = {
    "fetches": "fetches",
    "passes": "passes",
    "bytes": "bytes_per_pixel",
    "seconds": "seconds_per_megapixel",
}
ERRORS = {"delta-e": "delta_e_2000_mean", "p99": "delta_e_2000_p99", "l2": "relative_l2"}
ERROR_WORDS = {
    "delta-e": "Mean Delta E",
    "p99": "99th percentile of Delta E",
    "l2": "Relative L2",
}
HEADS = [
    *("kernel", "fetches", "passes", "bytes", "stored", "s/Mpixel", "Delta E", "95th", "99th"),
    *("above 1", "relative L2", "PSNR, dB", "energy drift", "asymmetry"),
]


def comparison(f: Figures) -> list[Any]:
    budget = [] if f["budget"] is None else budgets(f["budget"])
    kernels = kernel_tables(f) if f["rows"] else []
    return [*budget, *kernels, *([wrote(f)] if f["output"] else [])]


def budgets(f: Figures) -> list[Any]:
    parts: list[Any] = []
    for picture in dict.fromkeys(row["picture"] for row in f["rows"]):
        parts += _budget(f, [row for row in f["rows"] if row["picture"] == picture])
    return parts


def _budget(f: Figures, causes: list[Figures]) -> list[Any]:
    *alone, interaction, whole = causes
    named = [each for each in alone if each["in_whole"]]
    others = [each for each in alone if not each["in_whole"]]
    first = causes[0]
    simulated = f["model"] or Words("{} photons", f["photons"])
    heads = ["", "Delta E mean", "p95", "p99", "relative L2", "largest drift", "of the whole"]
    rows = [_cause(each) for each in (*named, interaction, whole, *others)]
    return [
        Words(
            "{} on {}, {} x {} pixels of {} mm: {} to {} mm, {}, {} " + plural(f["rank"], "term"),
            *(f["material"], first["picture"], first["width"], first["height"]),
            *(f["mm_per_pixel"], simulated, f["radius_mm"], f["method"], f["rank"]),
        ),
        Table(heads, rows),
        Words(
            "First: {} ({}). Then: {} ({}).",
            *(named[0]["cause"], named[0]["hint"], named[1]["cause"], named[1]["hint"]),
        ),
    ]


def _cause(row: Figures) -> list[Any]:
    name = row["cause"] if row["in_whole"] else f"({row['cause']})"
    return [
        name,
        row["delta_e_2000_mean"],
        row["delta_e_2000_p95"],
        row["delta_e_2000_p99"],
        Percent(row["relative_l2"]),
        Percent(widest(row["energy_drift"])),
        Percent(row["share_of_whole"], digits=0) if row["in_whole"] else "",
    ]


def setting(f: Figures) -> Words:
    threads = "1 thread" if f["threads"] == 1 else Words("{} threads", f["threads"])
    return Words(
        "{}, {}: kernels of {} pixels of {} mm against the whole 2D kernel, which lacks up to {} "
        "of a channel's light beyond the grid; seconds on {}, float64",
        *(f["material"], f["profile_method"], f["pixels"], f["mm_per_pixel"]),
        *(Percent(max(f["missing_share"])), threads),
    )


def front_words(f: Figures) -> Words:
    return Words(
        "no other kernel of the picture has as small an error ({}) at the cost ({})",
        *(f["error"], f["cost"]),
    )


def picture_line(picture: Figures) -> Words:
    return Words(
        "{}, {} x {} pixels, exposure {}",
        *(picture["name"], picture["width"], picture["height"], picture["exposure"]),
    )


def rows_of(f: Figures, picture: Figures) -> list[Figures]:
    """Rows of a picture by cost, then by error."""
    rows = [row for row in f["rows"] if row["picture"] == picture["name"]]
    cost, error = COSTS[f["cost"]], ERRORS[f["error"]]
    digits = ".2g" if f["cost"] == "seconds" else ""
    return sorted(rows, key=lambda row: (float(f"{row[cost]:{digits}}"), row[error]))


def kernel_cells(row: Figures) -> list[Any]:
    asymmetry = [each for each in row["radial_asymmetry"] if each is not None]
    return [
        row["fetches"],
        row["passes"],
        row["bytes_per_pixel"],
        row["kernel_bytes"],
        row["seconds_per_megapixel"],
        row["delta_e_2000_mean"],
        row["delta_e_2000_p95"],
        row["delta_e_2000_p99"],
        row["share_above_1"] if row["share_above_1"] is None else Percent(row["share_above_1"]),
        Percent(row["relative_l2"]),
        row["psnr_db"],
        Percent(widest(row["energy_drift"])),
        max(asymmetry) if asymmetry else None,
    ]


def kernel_table(f: Figures, picture: Figures, mark: str) -> Table:
    """The rows of a picture; those on the front have a ``mark``, as "* {}"."""
    rows = [
        [
            mark.format(row["label"]) if row["on_front"][f["error"]][f["cost"]] else row["label"],
            *kernel_cells(row),
        ]
        for row in rows_of(f, picture)
    ]
    return Table(HEADS, rows)


def left_out(f: Figures) -> list[Words]:
    return [Words("Left out {}: {}", *each.values()) for each in f["left_out"]]


def kernel_tables(f: Figures) -> list[Any]:
    parts: list[Any] = [setting(f)]
    for picture in f["pictures"]:
        parts += [picture_line(picture), kernel_table(f, picture, "* {}")]
    return [*parts, Words("* {}", front_words(f)), *left_out(f), *verdict(f)]


def verdict(f: Figures) -> list[Words]:
    units = {
        "fetches": "fetches a pixel",
        "passes": "passes",
        "bytes": "bytes a pixel",
        "seconds": "s a megapixel",
    }
    first, *others = f["verdict"]
    last = f["verdict"][-1]
    more = "".join(", {} from {}" for _ in others)
    named = [value for each in others for value in (each["label"], each["cost"])]
    words = "the cheapest, {}; the closest, {}" if others else "cheapest and closest, {}"
    unseen = [each for each in f["verdict"] if each["delta_e_2000_p95"] <= 1.0]
    tail: Any = "none has 95 % of every picture within a Delta E of 1"
    if unseen:
        tail = Words(
            "from {} on, 95 % of every picture are within a Delta E of 1", unseen[0]["label"]
        )
    return [
        Words(
            f"Take {{}} for {{}} {units[f['cost']]}{more}: over the pictures, no other is as near "
            "for as little.",
            *(first["label"], first["cost"], *named),
        ),
        Words(
            f"{{}} on the worst picture: {words}; {{}}.",
            ERROR_WORDS[f["error"]],
            *(_worst(f, each) for each in ([first, last] if others else [first])),
            tail,
        ),
    ]


def _worst(f: Figures, each: Figures) -> Words:
    error = Percent(each["error"]) if f["error"] == "l2" else each["error"]
    return Words("{} {} ({})", each["label"], error, each["picture"])


def markdown(f: Figures) -> list[Any]:
    """The file of ``compare --table t.md``, its columns apart by spaces."""
    parts: list[Any] = [Words("# {}: kernels by error and cost", f["material"]), setting(f)]
    for picture in f["pictures"]:
        parts += [Words("## {}", picture_line(picture)), kernel_table(f, picture, "**{}**")]
    return [*parts, Words("Bold: {}.", front_words(f)), *left_out(f), *verdict(f)]


def fronts(f: Figures) -> list[Any]:
    """``compare --all``."""
    rows = []
    for name in f["materials"]:
        own = [row for row in f["rows"] if row["material"] == name]
        for picture in dict.fromkeys(row["picture"] for row in own):
            on = [
                row
                for row in own
                if row["picture"] == picture and row["on_front"][f["error"]][f["cost"]]
            ]
            on.sort(key=lambda row: row[COSTS[f["cost"]]])
            values = [value for row in on for value in (row["label"], row[ERRORS[f["error"]]])]
            rows.append([name, picture, Words(", ".join("{} {}" for _ in on), *values)])
    heads = ["material", "picture", f"front of {f['error']} by {f['cost']}, cheapest first"]
    return [Table(heads, rows, alike=("material",)), *([wrote(f)] if f["output"] else [])]


def sheet(f: Figures) -> list[Any]:
    rows = [[row["label"], row["passes"] or None, *row["delta_e_2000_mean"]] for row in f["rows"]]
    return [
        Words(
            "{}: mean Delta E 2000 on {} x {} pixels of {} mm",
            *(f["material"], f["pixels"], f["pixels"], f["mm_per_pixel"]),
        ),
        Table(["kernel", "passes", *f["scenes"]], rows),
        wrote(f),
    ]


def convergence(f: Figures) -> list[Any]:
    rows = [
        [Words("{} photons", row["photons"]), row["seconds"], row["error"], None]
        for row in f["rows"]
    ]
    rows += [
        [
            Words("exact, tolerance {}", row["tolerance"]),
            *(row["seconds"], row["error"], row["estimate"]),
        ]
        for row in f["exact"]
    ]
    return [
        Words(
            "{}: error of F(r) as a share of the total; slope {} +- {}, theory -0.5",
            *(f["material"], f["slope"], f["slope_stderr"]),
        ),
        Table(["run", "seconds", "error", "own estimate"], rows),
    ]


# choose


def choice(f: Figures) -> list[Any]:
    figure = {"p95": "95th percentile", "p99": "99th percentile", "mean": "mean"}[f["tolerance_of"]]
    budgets = [
        Words(f", at most {{}} {key.removeprefix('most_')}", f[key])
        for key in ("most_fetches", "most_passes")
        if f[key] is not None
    ]
    asked = Words("least {} of Delta E", figure)
    if f["tolerance"] is not None:
        asked = Words("{} of Delta E within {}", figure, f["tolerance"])
    head = Words(
        "{} at {} m, {} mm per pixel, {}" + "{}" * len(budgets) + ":",
        *(f["material"], f["distance_mm"] / 1000.0, f["mm_per_pixel"], asked, *budgets),
    )
    judged = [
        Words(
            "judged on {}, {} x {} pixels of {} mm",
            *(each["irradiance"], each["width"], each["height"], each["mm_per_pixel"]),
        )
        for each in f["pictures"]
    ]
    if f["kernel"] is None:
        return [head, _no_blur(f), *judged, Words("No kernel is written.")]
    return [head, *_kernel_lines(f), *judged, wrote(f)]


def _no_blur(f: Figures) -> Words:
    if f["chosen"]:
        return Words(
            "no blur is needed: irradiance times diffuse reflectance has {}; any kernel would cost "
            "more.",
            _loss(f["chosen"]),
        )
    if f["pictures"]:
        return Words("no blur is needed: the head is under a pixel.")
    return Words(
        "no blur is needed: the profile is under a pixel, 99.9 % of it within {} mm.",
        f["support_mm"],
    )


def _kernel_lines(f: Figures) -> list[Any]:
    chosen, cheaper, dearer = f["chosen"], f["cheaper"], f["dearer"]
    lines = [
        Words(
            "{}: {} fetches a pixel in {} passes, {}, {} s a megapixel here",
            *(chosen["label"], chosen["fetches"], chosen["passes"], _loss(chosen)),
            f["kernel"]["seconds_per_megapixel"],
        )
    ]
    if cheaper:
        why: Any = Words("")
        if f["tolerance"] is not None and cheaper["error"] <= f["tolerance"]:
            why = Words(", on a wider view, which may have {}", 0.95 * f["tolerance"])
        lines.append(Words("cheaper{}: {}{}", _judged(f, cheaper), _beside(cheaper, chosen), why))
    if dearer:
        lines.append(Words("dearer{}: {}", _judged(f, dearer), _beside(dearer, chosen)))
    if f["unfitted"]:
        lines.append(Words(f"cannot be fitted to this profile: {', '.join(f['unfitted'])}"))
    return [*lines, *([_photons(f["photons"])] if f["photons"] else [])]


def _judged(f: Figures, step: Figures) -> str:
    if f["tolerance"] is None:
        return ""
    return " is not needed" if step["within"] else " is not enough"


def _loss(step: Figures) -> Words:
    return Words(
        "Delta E {} (95 % of pixels within {}, 99 % within {}; {} above 1)",
        *(step["delta_e_2000_mean"], step["delta_e_2000_p95"], step["delta_e_2000_p99"]),
        Percent(step["share_above_1"]),
    )


def _beside(step: Figures, chosen: Figures) -> Words:
    price: Any = "no fetches"
    if step["method"]:
        passes = plural(step["passes"], "pass")
        price = Words(f"{{}} fetches in {{}} {passes}", step["fetches"], step["passes"])
        if step["fetches"] != chosen["fetches"]:
            price = Words("{}, {} times as many", price, step["fetches"] / chosen["fetches"])
    return Words("{}, {} for {}", step["label"], _loss(step), price)


def _photons(f: Figures) -> Words:
    tried = [
        Words("{} Delta E {} in {} s", Exact(count), error, Rough(seconds))
        for count, error, seconds in zip(f["tried"], f["errors"], f["seconds"], strict=True)
    ]
    enough = Words("a walk of {} photons would do", Exact(f["photons"]))
    truth = "exact needs none"
    if f["photons"] is None:
        enough = Words("{} photons are not enough for a walk", Exact(f["tried"][-1]))
        truth = "montecarlo is the truth here"
    return Words(
        "photons: {} (" + ", ".join("{}" for _ in tried) + "); {}, {} s",
        *(enough, *tried, truth, Rough(f["profile_seconds"])),
    )


# import, export, chart


def imported(f: Figures) -> list[Any]:
    heads = ["channel", "diffuse reflectance", "std. error", "beyond grid"]
    keys = ["diffuse_reflectance", "diffuse_reflectance_stderr", "beyond_grid"]
    if f["transmittance"] is not None:
        heads, keys = [*heads, "transmittance"], [*keys, "transmittance"]
    return [
        Words("{}: {} annuli, to {} mm", f["source"], f["annuli"], f["radius_mm"]),
        Table(heads, by_channel(f, keys)),
        wrote(f),
    ]


def written(f: Figures) -> list[Any]:
    return [wrote(f)]


def angles(f: Figures) -> list[Any]:
    rows = [
        [
            name,
            f["rows"][0]["per_sr"][c],
            Percent(f["misplaced"][c], 2),
            Percent(f["misplaced_stderr"][c], 2),
        ]
        for c, name in enumerate(f["channels"])
    ]
    return [
        Words(
            "R_d in {} bins of the exit angle; misplaced: by angle, against cos times Fresnel",
            len(f["rows"]),
        ),
        Table(["channel", "first bin, 1/sr", "misplaced", "by noise alone"], rows),
        wrote(f),
    ]


def frequency(f: Figures) -> list[Any]:
    first = f["rows"][0]["response"]

    def fallen(share: float, c: int) -> float | str:
        below = [row["k_per_mm"] for row in f["rows"] if row["response"][c] < share * first[c]]
        return below[0] if below else "not reached"

    rows = [
        [name, first[c], fallen(0.5, c), fallen(0.1, c)] for c, name in enumerate(f["channels"])
    ]
    return [
        Words(
            "R(k) at {} frequencies, from 0 to {} rad/mm", len(f["rows"]), f["rows"][-1]["k_per_mm"]
        ),
        Table(
            ["channel", "R(0)", "half at k, rad/mm", "a tenth at k, rad/mm"],
            *(rows, ("a tenth at k, rad/mm",)),
        ),
        wrote(f),
    ]


def spectrum(f: Figures) -> list[Any]:
    rows = [
        [
            *(name, Percent(f["squared_share"][0][c]), Percent(f["absolute_share"][0][c])),
            f["rank_for_1_percent"][c],
        ]
        for c, name in enumerate(f["channels"])
    ]
    return [
        Words(
            "Share of the first singular value; {} x {} pixels of {} mm",
            *(f["pixels"], f["pixels"], f["mm_per_pixel"]),
        ),
        Table(["channel", "first, squared", "first, absolute", "terms for an error of 1 %"], rows),
        wrote(f),
    ]


def guide(f: Figures) -> list[Any]:
    keys = ("centre_share", "misplaced", "relative_frobenius_error", "weighted_residual")
    rows = [[k, *(Percent(f[key][i]) for key in keys)] for i, k in enumerate(f["k"])]
    names = ("centre_share", "misplaced", "frobenius_error", "weighted_residual")
    rows.append(["pre-integrated", *(Percent(f[f"preintegrated_{name}"]) for name in names)])
    return [
        Words(
            "Channel {}; {} x {} pixels of {} mm",
            *(f["channel"], f["pixels"], f["pixels"], f["mm_per_pixel"]),
        ),
        Table(["k", "middle pixel", "misplaced", "Frobenius error", "weighted misfit"], rows),
        wrote(f),
    ]


def models(f: Figures) -> list[Any]:
    keys = ("total_error", "cumulative_error", "l2_error")
    rows = [
        [
            f"{row['method']} {name}",
            row["diffuse_reflectance"][c],
            *(None if row["method"] == "exact" else Percent(row[key][c]) for key in keys),
        ]
        for row in f["rows"]
        for c, name in enumerate(f["channels"])
    ]
    heads = ["method, channel", "diffuse reflectance", "error", "largest of F(r)", "L2 of R_d"]
    return [
        Words(
            "{}: errors against the exact solution; {} photons on {} annuli of {} mm",
            *(f["material"], f["photons"], f["annuli"], f["dr_mm"]),
        ),
        Table(heads, rows),
        wrote(f),
    ]


def kernel_chart(f: Figures) -> list[Any]:
    rows = [
        [
            *(name, f["energy"][c], Percent(f["energy_error"][c])),
            *(Percent(f["relative_frobenius_error"][c]), Percent(f["misplaced"][c])),
        ]
        for c, name in enumerate(f["channels"])
    ]
    return [
        Words(
            "{}, rank {}, {} x {} pixels of {} mm; against {}",
            *(f["method"], f["rank"], f["pixels"], f["pixels"], f["mm_per_pixel"], f["profile"]),
        ),
        Table(["channel", "energy", "energy error", "Frobenius error", "misplaced"], rows),
        wrote(f),
    ]


# show


def kernel_shown(f: Figures) -> list[Any]:
    settings = "".join(f", {key} {_plain(value)}" for key, value in f["settings"].items())
    channels = [
        [
            *(name, f["energy"][c], f["scale"][c]),
            *(Percent(f["relative_frobenius_error"][c]), Percent(f["energy_error"][c])),
        ]
        for c, name in enumerate(f["channels"])
    ]
    terms = [
        [
            f"{name} {t + 1}",
            "+" if f["sign"][t][c] > 0 else "-",
            *(f["term_energy"][t][c], f["middle_weight"][t][c]),
        ]
        for c, name in enumerate(f["channels"])
        for t in range(f["rank"])
    ]
    heads = ["channel", "energy", "scale", "Frobenius error", "energy error"]
    return [
        Words("{}: separable kernel ({})", f["file"], f["format"]),
        Words("material  {}", f["material"]),
        Words(
            "profile   {}, {} photons, seed {}, sha256 {}",
            *(f["profile_method"], f["photons"], f["seed"], f["profile_sha256"][:16]),
        ),
        Words(
            "fit       {}, {} terms" + settings + ", sssfit {}",
            *(f["method"], f["rank"], f["version"]),
        ),
        Words(
            "pixels    {} x {} of {} mm, the outermost {} mm from the axis",
            *(f["pixels"], f["pixels"], f["mm_per_pixel"], f["support_mm"]),
        ),
        Table(heads, channels, alike=("scale",)),
        Table(["channel, term", "sign", "energy", "middle pixel of the pass"], terms, ("sign",)),
        Words("the fit found"),
        *(
            Words(
                "{}:  eigenvalues [{}, {}]  scaled_by {}",
                *(name, *found["eigenvalues"], found["scaled_by"]),
            )
            for name, found in f["parameters"].items()
        ),
    ]


def _plain(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)


def shown(f: Figures) -> list[Any]:
    return [
        *_origin(f),
        *_coefficients(f),
        _where_light_went(f),
        _radii(f),
        Words(
            "specular reflectance {}, not part of diffuse R; sum = specular + diffuse + absorbed + "
            "unfinished" + ("" if f["transmittance"] is None else " + transmitted"),
            f["specular_reflectance"],
        ),
        *_empty(f),
    ]


def _origin(f: Figures) -> list[Words]:
    material = f["material"]
    source = f" ({material['source']})" if material and material["source"] else ""
    walks: Any = Words("{} photons, seed {}", f["photons"], f["seed"])
    walks = "no photons" if f["photons"] is None else walks
    width = Words("{} mm", f["dr_mm"]) if f["uniform"] else "varying width"
    return [
        Words("{}: diffuse reflectance profile ({})", f["file"], f["format"]),
        Words("material  {}" + source, material["name"] if material else "unknown material"),
        Words(
            "method    {}, {}, sssfit {}",
            *(f["method"] or "unknown", walks, f["version"] or "version unknown"),
        ),
        Words("grid      {} annuli of {}, to {} mm", f["annuli"], width, f["radius_mm"]),
    ]


def _coefficients(f: Figures) -> list[Table]:
    material = f["material"]
    if material is None or not material["layers"]:
        return []
    rows = [
        [
            f"{k + 1} {name}" if len(material["layers"]) > 1 else name,
            *(layer["eta"], layer["g"][c], layer["sigma_a_per_mm"][c], layer["sigma_s_per_mm"][c]),
            *(material["albedo"][k][c], material["mean_free_path_mm"][k][c]),
            "infinite" if layer["thickness_mm"] is None else layer["thickness_mm"],
        ]
        for k, layer in enumerate(material["layers"])
        for c, name in enumerate(material["channels"])
    ]
    heads = ["channel", "eta", "g", "sigma_a, 1/mm", "sigma_s, 1/mm", "single-scattering albedo"]
    heads += ["transport MFP, mm"]
    one = () if len(material["layers"]) > 1 else ("eta", "g", "thickness, mm")
    return [Table([*heads, "thickness, mm"], rows, alike=one)]


def _where_light_went(f: Figures) -> Table:
    heads = ["channel", "diffuse R", "+- stderr", "beyond grid", "of diffuse", "absorbed"]
    heads += ["transmitted"] * (f["transmittance"] is not None)
    heads += ["+- stderr"] * (f["transmittance_stderr"] is not None) + ["unfinished", "sum - 1"]
    rows = []
    for c, name in enumerate(f["channels"]):
        diffuse, beyond = f["diffuse_reflectance"][c], f["beyond_grid"][c]
        stderr = f["energy_balance_stderr"]
        balance: Any = Rough(f["energy_balance"][c])
        if stderr is not None:
            balance = Words("{} +- {}", balance, Rough(max(stderr[c], 1e-12)))
        rows.append(
            [
                *(name, diffuse, f["diffuse_reflectance_stderr"][c], beyond),
                Percent(beyond / diffuse) if diffuse > 0 else None,
                None if f["absorbed"] is None else f["absorbed"][c],
                *([] if f["transmittance"] is None else [f["transmittance"][c]]),
                *([] if f["transmittance_stderr"] is None else [f["transmittance_stderr"][c]]),
                Rough(f["unfinished"][c]),
                None if f["absorbed"] is None else balance,
            ]
        )
    return Table([*heads], rows, alike=("unfinished",))


def _radii(f: Figures) -> Table:
    keys = [f"radius_of_{share}_percent_mm" for share in (50, 90, 99)]
    heads = ["channel", *(f"{share} % within, mm" for share in (50, 90, 99))]
    if f["empty_annuli"] is not None:
        heads, keys = [*heads, "empty"], [*keys, "empty_annuli"]
    return Table(heads, by_channel(f, keys), alike=("empty",))  # channels share their photons


def _empty(f: Figures) -> list[Words]:
    if not any(f["empty_annuli"] or [0]):
        return []
    return [
        Words(
            "empty: annuli in which nothing was seen; their standard error of 0 says that, and not "
            "that R_d is 0 there."
        )
    ]


_MAKE = "materials --from-reflectance .4,.2,.1 --mean-free-path 1.3,.9,.7 --eta 1.3 -o lard.toml"


def stability(f: Figures) -> list[Any]:
    parts: list[Any] = []
    for panel in f["panels"]:
        head = Words(
            "{}: {} ({}); limit {}; beyond it {}",
            *(panel["stress"], panel["title"], panel["x"], panel["limit"], panel["fails"]),
        )
        rows = [[each["method"], _safe(each)] for each in panel["findings"]]
        parts += [head, Table(["method", "safe"], rows)]
    return [*parts, *map(Words, f["notes"])]


def _safe(finding: Figures) -> Any:
    if finding["safe"] == "never":
        return "nowhere that was tried"
    edge = finding["below"]
    return Words("from {} ({} to {})", edge["at"], edge["low"], edge["high"])


def motion(f: Figures) -> list[Any]:
    head = Words(
        "{}, {} under {} light: {} frames of {} x {} pixels, target variance {}; means leave out "
        "the first {}",
        *(f["material"], f["irradiance"], f["light"], f["frames"], f["width"], f["height"]),
        *(f["target_variance"], f["cold_frames"]),
    )
    rows = [
        [each["label"], each["mean_fetches"], each["rmse"], Percent(each["rmse"] / f["level"])]
        for each in f["tracks"]
    ]
    labels = {each["name"]: each["label"] for each in f["tracks"]}
    saved = [
        Words(
            "{}: {} {} samples than without control variates",
            labels[name],
            Percent(abs(share)),
            "more" if share < 0.0 else "fewer",
        )
        for name, share in f["saving"].items()
    ]
    table = Table(["renderer", "fetches a pixel", "rmse", "of the light"], rows)
    frames = [each for each in f["output"] if "/" in each]
    lines = [Words("Wrote {} frames to {}", len(frames), "shots")] if frames else []
    return [
        head,
        table,
        *saved,
        *lines,
        *(Words("Wrote {}", each) for each in f["output"][len(frames) :]),
    ]


def variates(f: Figures) -> list[Any]:
    rows = []
    for light, medians in f["table"].items():
        quartiles = [Words("{}-{}", *each) for each in f["quartiles"][light].values()]
        rows += [[light, *medians.values()], ["quartiles", *quartiles]]
        rows.append(["published", *f["published"][light].values()])
    lines = [
        Words(
            "coefficient, {}: {} ({} to {}), published {}",
            *(name.replace("_", "-"), f["coefficients"][name]),
            *(*f["coefficient_quartiles"][name], f["published_coefficients"][name]),
        )
        for name in f["coefficients"]
    ]
    return [
        Words("Medians over {} seeds of the root of the residual's moving variance", f["seeds"]),
        Table(["light", *f["table"]["still"]], rows),
        Words("largest deviation from a published value {}", Percent(f["largest_deviation"])),
        *lines,
    ]


def preset(f: Figures) -> list[Any]:
    rows = [
        [name, _parameter(each["value"]), each["unit"] or None, each["meaning"]]
        for name, each in f["parameters"].items()
    ]
    head = Words("{} for {}: {}", f["material"], f["engine"], f["model"])
    table = Table(["parameter", "value", "unit", "meaning"], rows, alike=("unit",))
    return [head, table, Words("Lost: {}", f["lost"]), wrote(f)]


def _parameter(value: Any) -> Any:
    if isinstance(value, list):
        return Words(" ".join(["{}"] * len(value)), *map(_parameter, value))
    if isinstance(value, bool):
        return str(value)
    return Rough(value) if isinstance(value, float | int) else value


def presets_listed(f: Figures) -> list[Any]:
    rows = [
        [each["preset"], each["engine"], each["inverse"], ", ".join(each["chosen"]) or None]
        for each in f["presets"]
    ]
    return [Table(["preset", "engine", "back to a", "what you choose"], rows)]


def presets_compared(f: Figures) -> list[Any]:
    pictures = [f"{each}, mean / p95" for each in f["pictures"]]
    rows = [
        [
            each["preset"],
            *(
                Words("{} / {}", Rough(mean), Rough(p95))
                for mean, p95 in zip(each["mean"], each["p95"], strict=True)
            ),
        ]
        for each in f["presets"]
    ]
    told: dict[str, list[str]] = {}
    for each in f["presets"]:
        for words in each["warnings"]:
            told.setdefault(words, []).append(each["preset"])
    return [
        Words("{}: Delta E 2000 of every engine's own diffusion", f["material"]),
        Table(["preset", *pictures], rows),
        *(Words("{}: {}", ", ".join(names), words) for words, names in told.items()),
        *(Words("{}: left out, {}", name, why) for name, why in f["left_out"].items()),
    ]


_OF_WORK = {"whole": "nothing left out", "saved": "with savings", "screen": "screen space"}
_SCENE_STAGES = ("shadows", "irradiance", "convolution", "picture")


def scene(f: Figures) -> list[Any]:
    head = Words(
        "{} of {} units, {} apart, from {} units (100 mm each); {} degrees, {} x {} "
        "pixels, maps of {} texels",
        *(
            f"{f['heads']} {plural(f['heads'], 'head')}",
            f["head_units"],
            f["spacing_units"],
            f["distance_units"],
            f["fov_degrees"],
        ),
        *(f["width"], f["height"], f["map_size"]),
    )
    every = [f["work"][name] for name in _OF_WORK]
    rows = [
        ["texels lit", *(Exact(each["texels_lit"]) for each in every)],
        ["texels convolved", *(Exact(each["texels_convolved"]) for each in every)],
        *(
            [f"{name} (ms)", *(Rough(each["milliseconds"].get(name, 0)) for each in every)]
            for name in _SCENE_STAGES
        ),
        ["all stages (ms)", *(each["total_milliseconds"] for each in every)],
        ["mean Delta E", *(Rough(each["mean_delta_e"]) for each in every)],
        ["largest Delta E inside", *(_or_none(each["largest_inside"]) for each in every)],
    ]
    ends = Words(
        "{} times fewer texels convolved, {} times as fast",
        *(f["speed_up_texels"], f["speed_up_seconds"]),
    )
    table = Table(["", *_OF_WORK.values()], rows)
    return [head, table, ends, *(Words("Wrote {}", each) for each in f["output"])]


def _or_none(value: float | None) -> Any:
    return None if value is None else Rough(value)


def speed_ups(f: Figures) -> list[Any]:
    rows = []
    for k, heads in enumerate(f["heads"]):
        for name, key in (("texels", "texels"), ("time", "seconds"), ("published", "published")):
            rows.append([f"{heads}, {name}", *f[key][k]])
    return [Table(["heads", *(f"{each:g}" for each in f["distances"])], rows)]


def report(f: Figures) -> list[Any]:
    kernels, pictures = len(f["kernels"]), len(f["pictures"])
    return [
        Words(
            "{} {} on {} {}; on the Pareto front: {}",
            *(kernels, plural(kernels, "kernel"), pictures, plural(pictures, "picture")),
            ", ".join(f["front"]),
        ),
        *(Words("Wrote {}", each) for each in f["output"]),
    ]


def _axes(f: Figures) -> str:
    return " x ".join(f"{n} {plural(n, 'value')} of {name}" for name, n in f["axes"].items())


def sweep(f: Figures) -> list[Any]:
    counts = (f["points"], _axes(f), f["computed"], f["finished_before"])
    head = Words(
        "{} by {}: {} points ({}), {} computed, {} before", f["material"], f["method"], *counts
    )
    rest = Words("{} annuli of {} mm, {} s", f["annuli"], f["dr_mm"], Rough(f["seconds"]))
    return [head, rest, wrote(f)]


def dry_run(f: Figures) -> list[Any]:
    parts = ("seconds", "workers", "start_seconds", "work_seconds", "write_seconds")
    return [
        Words("{} by {}: {} points ({})", f["material"], f["method"], f["points"], _axes(f)),
        Words("{} annuli of {} mm, {} MB", f["annuli"], f["dr_mm"], f["bytes"] / 1e6),
        Words(
            "about {} s on {} workers: {} s to start, {} s of work, {} s to write",
            *(f[key] for key in parts),
        ),
        Words("{} tasks, the longest {} s", f["tasks"], f["longest_task_seconds"]),
    ]


# A command that prints each of them, on the files of ``cli_world``.
PRINTED: dict[str, Layout] = {
    "materials": materials_list,
    "materials wax.toml": one_material,
    "materials plate.toml": one_material,
    "materials deon-skin": six_gaussians,
    f"{_MAKE} --light normal": inversion,
    f"{_MAKE} --light diffuse": inversion,
    "simulate wax.toml --photons 4000 --dr .2 --radius 6": simulation,
    "simulate wax.toml --photons 4000 --dr .2 --radius 6 --resume": simulation,
    "simulate wax.toml --photons 4000 --dr .2 --radius 40 --seed 3": simulation,
    "simulate plate.toml --photons 3000 --dr .2 --radius 4": simulation,
    "simulate wax.toml --target-error 20% --dr .5 --radius 9": simulation,
    "simulate --all --photons 3000 --dr .5 --radius 20": simulation,
    "simulate --all --target-error 20% --dr .5 --radius 20": simulation,
    "simulate wax.toml --method exact": simulation,
    "simulate wax.toml --method burley --mapping diffuse --dr .3 --radius 8": simulation,
    "simulate wax.toml --method dipole --dr .3 --radius 8": simulation,
    "simulate plate.toml --method multipole --dr .3 --radius 8": simulation,
    "sweep points.toml": sweep,
    "sweep points.toml --dry-run": dry_run,
    "fit wax.profile.npz --method svd --rank 2 --energy keep --mm-per-pixel .4": fit,
    "fit wax.profile.npz --method burley --mm-per-pixel .4": fit,
    "render --irradiance disk --size 24x16 --structure": rendering,
    "render --irradiance edge --size 24x16 --border zero": rendering,
    "render --irradiance head --size 24x16 --screen": rendering,
    "render --irradiance edge --size 24x16 --difference d.exr --gain 4": rendering,
    "render --irradiance edge --size 24x16 --difference d.png --difference-map signed": rendering,
    "render --irradiance edge --size 24x16 --difference d.exr --difference-map absolute": rendering,
    "render wax.gaussians2.kernel.json --irradiance head --size 48x48 --transmit": rendering,
    "compare wax.profile.npz --what kernels --size 24x16": comparison,
    "compare wax.profile.npz --what kernels --size 24x16 --error l2 --cost passes": comparison,
    "compare wax.toml --what budget --rank 2 --size 24x16": comparison,
    "compare wax.toml --size 24x16": comparison,
    "compare --all --size 24x16": fronts,
    "compare --all --size 24x16 --error l2 --cost passes": fronts,
    "compare wax.profile.npz --what sheet --chart s.png": sheet,
    "report wax.profile.npz": report,
    "compare wax.profile.npz --what front --size 24x16": fronts,
    "compare wax.profile.npz --what front --size 24x16 --chart f.png --table f.md": fronts,
    "stability wax.toml": stability,
    "motion wax.toml": motion,
    "motion wax.toml --frames shots --chart m.png": motion,
    "motion --table": variates,
    "scene wax.svd2.kernel.json": scene,
    "scene wax.svd2.kernel.json --heads 3 --distance 8 -o s.png": scene,
    "scene wax.svd2.kernel.json --table": speed_ups,
    "export wax.profile.npz --preset hdrp": preset,
    "export wax.profile.npz --preset iryoku": preset,
    "export --list": presets_listed,
    "compare wax.profile.npz --what presets --size 24x16": presets_compared,
    "choose wax.toml": choice,
    "choose wax.toml --tolerance 6": choice,
    "choose wax.toml --tolerance 7": choice,
    "choose wax.toml --tolerance 8": choice,
    "choose wax.toml --tolerance 9": choice,
    "import table.csv": imported,
    "import r.mco g.mco --channels a,b -o x.profile.npz": imported,
    "export --format csv": written,
    "export --format hlsl": written,
    "chart": written,
    "chart wax.profile.npz --spectrum": spectrum,
    "chart wax.profile.npz --frequency": frequency,
    "chart angles.profile.npz --angles": angles,
    "chart wax.profile.npz --guide": guide,
    "chart wax.toml --models": models,
    "chart wax.svd2.kernel.json": kernel_chart,
    "chart wax.toml": written,
    "show wax.svd2.kernel.json": kernel_shown,
    "show wax.toml": one_material,
    "show plate.toml": one_material,
    "show wax.profile.npz": shown,
    "show plate.profile.npz": shown,
}
