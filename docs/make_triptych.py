"""Draw docs/triptych.png, the first picture of the README: no blur, a kernel, the truth.

python docs/make_triptych.py

It runs the README's session in a temporary folder and shows what its last command writes: the lit
head by the kernel and the true picture, and the same light times the albedo, without blur.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from matplotlib import font_manager
from PIL import Image, ImageDraw, ImageFont
from sections import DOCS

from sssfit.formats.colours import srgb_encode
from sssfit.formats.pictures import load_image
from sssfit.kernel import Taps
from sssfit.measure.delta_e import auto_exposure
from sssfit.measure.score import measure
from sssfit.scene.made import make_scene

MM_PER_PIXEL = 0.3  # the default
CROP = (slice(205, 595), slice(170, 530))  # from the brow to the chin
SESSION = (
    ("simulate", "skin1", "--method", "exact"),
    ("fit",),
    ("render", "--irradiance", "head", "-o", "kernel.exr", "--truth", "truth.exr"),
)
GAP, LABEL = 8, 34  # pixels


def run_session(folder):
    """Run the README's commands; return the kernel, its picture and the truth, linear."""
    for command in SESSION:
        subprocess.run([sys.executable, "-m", "sssfit.cli", *command], cwd=folder, check=True)
    (path,) = folder.glob("*.taps.json")
    pictures = [load_image(folder / name).pixels for name in ("kernel.exr", "truth.exr")]
    return Taps.load(path), *pictures


def triptych(kernel, picture, truth):
    """Return the three pictures side by side, 8-bit sRGB, with their labels."""
    height, width = truth.shape[:2]
    scene = make_scene("head", height=height, width=width, mm_per_pixel=MM_PER_PIXEL)
    unblurred = scene.irradiance * kernel.energy
    exposure = auto_exposure(truth, mask=scene.mask)
    panels = [(unblurred, "no blur"), (picture, f"{kernel.fetches:.0f} fetches")]
    rows = [(shown, label, error(shown, truth, scene.mask)) for shown, label in panels]
    rows.append((truth, "truth: the whole 2D kernel", None))
    return page([(codes(shown, exposure), words(*rest)) for shown, *rest in rows])


def error(picture, truth, mask):
    """Return the 95th percentile of CIE Delta E 2000 over the head."""
    return measure(picture, truth, mask=mask).delta_e_2000_p95


def words(label, value):
    """Return what stands under a picture."""
    return label if value is None else f"{label}: 95 % within ΔE {value:.2g}"


def codes(linear, exposure):
    """Return 8-bit sRGB of the face, dithered by half a code so that soft shades show no bands."""
    noise = np.random.default_rng(1).uniform(-0.5, 0.5, linear.shape)
    encoded = 255.0 * srgb_encode(np.clip(exposure * linear, 0.0, 1.0)) + noise
    return np.clip(np.rint(encoded), 0, 255).astype(np.uint8)[CROP]


def page(panels):
    """Put pictures in a row on white, each over its label."""
    height, width = panels[0][0].shape[:2]
    size = (len(panels) * (width + GAP) - GAP, height + LABEL)
    image = Image.new("RGB", size, "white")
    pen = ImageDraw.Draw(image)
    font = ImageFont.truetype(font_manager.findfont("DejaVu Sans"), 17)
    for place, (pixels, label) in enumerate(panels):
        left = place * (width + GAP)
        image.paste(Image.fromarray(pixels), (left, 0))
        middle = (left + width // 2, height + LABEL // 2)
        pen.text(middle, label, fill="black", font=font, anchor="mm")
    return image


def main():
    """Run the session and draw."""
    with tempfile.TemporaryDirectory() as folder:
        triptych(*run_session(Path(folder))).save(DOCS / "triptych.png", optimize=True)


if __name__ == "__main__":
    main()
