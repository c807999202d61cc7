"""Write the section of docs/cascades.md on cascades in a shader, and draw docs/skin1-outline.png.

python docs/make_shading.py
"""

import numpy as np
from make_triptych import page
from sections import DOCS, put_section

from sssfit.compare.motion import motion
from sssfit.fit import fit_preintegrated, fit_taps
from sssfit.formats.colours import srgb_encode
from sssfit.material import load_material
from sssfit.measure.delta_e import auto_exposure
from sssfit.measure.score import measure
from sssfit.render.reference import render_reference
from sssfit.render.screen import render_screen
from sssfit.render.screen_taps import render_screen_taps
from sssfit.render.taps import render_taps
from sssfit.scene.made import make_scene
from sssfit.scene.record import Scene
from sssfit.simulate import simulate_exact

PITCH_MM, PIXELS = 0.3, 256
STRUCTURES = ("1|1-2-2", "1-1|2-2|2-2", "1-1|1-2|2-2|2-2", "1-1-2-2")
BEST = "1-1|2-2|2-2"
FORMATS = ("float32", "half", "r11g11b10")
FAR_MM = 1e7  # seen from so far that a slope is the same for all pixels
PICTURES = (("disk", {"radius_mm": 19.2}), ("edge", {"angle_degrees": 30.0}), ("points", {}))
EAR = (slice(240, 470), slice(95, 225))  # rows and columns of the head of 720 x 720 pixels
ZOOM = 3

TEXT = """All figures of skin1, exact profile, 0.3 mm: mean / 99th percentile of Delta E 2000.

**Formats.** The head by 1-1|2-2|2-2 with the pictures between its passes rounded, against the true
picture and against the picture without rounding:

| between passes | true kernel | without rounding |
|---|---|---|
{formats}

**Borders.** An edge of light at 30 degrees on a disk of 18 mm radius, on two halves of the picture
2.4 mm apart, and on a strip 3.6 mm wide, every pass divided by coverage; against the true kernel
with the same rule, conv(A E) / conv(A) times the energy:

| kernel | disk | halves | strip |
|---|---|---|---|
{borders}

![The true kernel and a cascade at the outline of an ear](skin1-outline.png)

**Tilted surfaces.** A plane tilted by 60 degrees about the vertical, seen from afar, so that a
pixel covers 0.3 x 0.6 mm of it, compared with the true kernel on the surface, with depth
differences weighted by the Gaussian factor and with depth ignored:

| kernel | picture | facing the eye | 60 degrees | 60 degrees, not followed |
|---|---|---|---|---|
{tilted}

**Motion.** 99th percentile of Delta E within 16 pixels of a point as large as a pixel, and of the
middle of an edge at 30 degrees, each at 10 x 10 positions in steps of a tenth of a pixel, against
the true kernel at the same position: least to largest, and their difference. In the last column the
point is moved by a whole pixel along x, y and both, and the picture is shifted back and compared
with the unmoved one; the largest of the three is given:

| kernel | point | change | edge | change | moved by a pixel |
|---|---|---|---|---|---|
{moved}
"""


def row(*cells):
    """Return a row of a table; a structure's bars would end its cell."""
    return f"| {' | '.join(each.replace('|', chr(92) + '|') for each in cells)} |"


def shown(image, truth, mask=None):
    """Return mean and 99th percentile."""
    score = measure(image, truth, mask=mask)
    return f"{score.delta_e_2000_mean:.2f}/{score.delta_e_2000_p99:.2f}"


def format_rows(taps, profile):
    """Return a row for each format of the pictures between passes."""
    head = make_scene("head", height=PIXELS, width=PIXELS, mm_per_pixel=PITCH_MM)
    truth, exact = render_reference(head, profile), render_taps(head, taps)
    yield row("not rounded", shown(exact, truth, head.mask), "")
    for name in FORMATS:
        image = render_taps(head, taps, intermediate=name)
        yield row(name, *(shown(image, each, head.mask) for each in (truth, exact)))


def true_within(scene, coverage, profile):
    """Return the true picture of an object: conv(A E) / conv(A) times the energy."""
    pitch = scene.mm_per_pixel
    light = render_reference(Scene("light", scene.irradiance * coverage[..., None], pitch), profile)
    part = render_reference(Scene("object", coverage[..., None], pitch), profile)
    part = np.where(coverage[..., None] > 0.0, part, 1.0)
    return np.where(coverage[..., None] > 0.0, profile.diffuse_reflectance * light / part, 0.0)


def objects():
    """Return the coverage of a disk, of two halves and of a strip."""
    y, x = PITCH_MM * (np.mgrid[:PIXELS, :PIXELS] + 0.5 - 0.5 * PIXELS)
    inside = np.hypot(x, y) < 18.0, np.abs(x) > 1.2, np.abs(y) < 1.8
    return [each.astype(float) for each in inside]


def flat_plane(irradiance, coverage):
    """Return a plane that faces the eye, and is there where it is covered."""
    depth = np.full(coverage.shape, FAR_MM)
    mask = coverage.astype(np.int32)
    more = {"distance_mm": FAR_MM, "depth_mm": depth, "mask": mask}
    return Scene("plane", irradiance, PITCH_MM, **more)


def border_rows(kernels, profile):
    """Return a row for each kernel."""
    size = {"height": PIXELS, "width": PIXELS, "mm_per_pixel": PITCH_MM}
    lit = make_scene("edge", **size, angle_degrees=30.0)
    truths = [(each, true_within(lit, each, profile)) for each in objects()]
    for name, kernel in kernels.items():
        cells = []
        for coverage, truth in truths:
            image = on_screen(flat_plane(lit.irradiance, coverage), kernel, "none")
            cells.append(shown(image, truth, coverage))
        yield row(name, *cells)


def on_screen(scene, kernel, follow):
    """Render a scene in screen space."""
    render = render_screen if hasattr(kernel, "signs") else render_screen_taps
    return render(scene, kernel, follow=follow)


def tilted(name, columns, **own):
    """Return a lit plane of pixels so many columns wide, and their light on square pixels."""
    wide = make_scene(
        name, height=PIXELS, width=PIXELS * columns, mm_per_pixel=PITCH_MM, **own
    ).irradiance
    light = wide.reshape(PIXELS, PIXELS, columns, -1).mean(axis=2)
    across = PITCH_MM * (np.arange(PIXELS) - PIXELS // 2)
    tangent = np.sqrt(columns**2 - 1.0)  # a pixel covers 1 / cos of its width
    depth = np.broadcast_to(FAR_MM + tangent * across, (PIXELS, PIXELS))
    scene = Scene(name, light, PITCH_MM, distance_mm=FAR_MM, depth_mm=depth)
    return scene, Scene(name, np.repeat(light, columns, axis=1), PITCH_MM)


def tilt_errors(kernel, profile, columns, follow, name, own):
    """Return a cell: the error on the tilted plane."""
    scene, on_surface = tilted(name, columns, **own)
    truth = render_reference(on_surface, profile)
    truth = truth.reshape(PIXELS, PIXELS, columns, -1).mean(axis=2)
    return shown(on_screen(scene, kernel, follow), truth)


def tilt_rows(kernels, profile):
    """Return a row for each kernel and picture."""
    for label, kernel in kernels.items():
        for name, own in PICTURES:
            ways = ((1, "none"), (2, "gaussian"), (2, "none"))
            yield row(label, name, *(tilt_errors(kernel, profile, *w, name, own) for w in ways))


def motion_rows(kernels, profile):
    """Return a row for each kernel."""
    for label, kernel in kernels.items():
        found = motion(kernel, profile)
        spans = (f"{low:.2f} to {high:.2f}" for low, high in (found.point, found.edge))
        changes = (f"{each:.2f}" for each in (found.point_change, found.edge_change))
        cells = [each for pair in zip(spans, changes, strict=True) for each in pair]
        yield row(label, *cells, f"{found.moved:.2f}")


def outline(taps, profile):
    """Return an ear by the true kernel, by the cascade, and by the cascade without coverage."""
    head = make_scene("head", height=720, width=720, mm_per_pixel=PITCH_MM)
    covered = (head.mask > 0).astype(float)
    truth = true_within(head, covered, profile)
    images = (
        ("the true kernel", truth),
        (f"{taps.structure} with coverage", render_taps(head, taps, coverage=covered)),
        ("without coverage", render_taps(head, taps) * covered[..., None]),
    )
    exposure = auto_exposure(truth, mask=head.mask)
    panels = []
    for label, image in images:
        score = (
            ""
            if image is truth
            else f", p99 {shown(image[EAR], truth[EAR], covered[EAR]).split('/')[1]}"
        )
        large = np.repeat(np.repeat(image[EAR], ZOOM, axis=0), ZOOM, axis=1)
        codes = np.rint(255.0 * srgb_encode(np.clip(exposure * large, 0.0, 1.0))).astype(np.uint8)
        panels.append((codes, label + score))
    return page(panels)


def main():
    """Write the section and the picture."""
    profile = simulate_exact(load_material("skin1"))
    cascades = {each: fit_taps(profile, stages=each).kernel for each in STRUCTURES}
    still = fit_taps(profile, stages=BEST, still=True).kernel
    kernels = {**cascades, "preintegrated": fit_preintegrated(profile).kernel}
    some = {each: kernels[each] for each in (BEST, "1-1-2-2", "preintegrated")}
    text = TEXT.format(
        formats="\n".join(format_rows(cascades[BEST], profile)),
        borders="\n".join(border_rows(kernels, profile)),
        tilted="\n".join(tilt_rows(some, profile)),
        moved="\n".join(motion_rows({**kernels, f"{BEST}, still": still}, profile)),
    )
    put_section("cascades.md", "docs/make_shading.py", text)
    outline(cascades[BEST], profile).save(DOCS / "skin1-outline.png", optimize=True)


if __name__ == "__main__":
    main()
