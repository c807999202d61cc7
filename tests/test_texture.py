"""Diffusion in texture space: the image-space renderer on a quad, and what may be left out."""

import dataclasses
import itertools

import numpy as np
import pytest
from meshes import cube, quad, sphere

from sssfit.errors import RenderError
from sssfit.fit import fit_gaussians, fit_result, fit_svd
from sssfit.material import load_material
from sssfit.render import render
from sssfit.render.drawn import draw_texture, draw_view
from sssfit.render.lights import PointLight, draw_shadows, irradiance_at, specular_at
from sssfit.render.texture import Savings, render_texture
from sssfit.render.texture_blur import blur_texture
from sssfit.render.texture_level import Level
from sssfit.scene.camera import CLIP_PLANES, Camera
from sssfit.scene.charts import charts_of
from sssfit.scene.mesh import Mesh
from sssfit.simulate import simulate_dipole

PITCH = 0.5
SIZE = 96
LIGHT = PointLight((0.0, 0.0, 1000.0), (1.0, 0.8, 0.6))


@pytest.fixture(scope="module")
def profile():
    return simulate_dipole(load_material("skin1"))


@pytest.fixture(scope="module")
def kernels(profile):
    near = {"mm_per_pixel": PITCH, "support_mm": 5.0}
    return {
        "dense": fit_gaussians(profile, terms=2, **near).kernel,
        "negative": fit_svd(profile, rank=2, **near).kernel,
        "cascade": fit_result(profile, "cascade", stages="1-1|1", mm_per_pixel=PITCH).kernel,
        "taps": fit_result(profile, "gaussians", terms=2, taps=9, **near).kernel,
    }


def spots(size, seed=1):
    """Light in the middle, so that no border is reached."""
    light = np.zeros((size, size, 3))
    middle = slice(3 * size // 8, 5 * size // 8)
    light[middle, middle] = np.random.default_rng(seed).uniform(
        0.0, 1.0, light[middle, middle].shape
    )
    return light


@pytest.mark.parametrize("name", ["dense", "negative", "cascade", "taps"])
def test_a_flat_texture_is_the_image_space_picture(kernels, name):
    """Borders are far: what a chart's end does is not what a picture's border does."""
    light = spots(SIZE)
    flat = Level.of_map(np.ones((SIZE, SIZE)), np.full((SIZE, SIZE, 2), 1.0 / PITCH))
    found, _ = blur_texture(light, flat, kernels[name])
    wanted = render(light, kernels[name], border="zero")
    # Fetches at whole texels lie on them but for rounding.
    inner = slice(SIZE // 4, 3 * SIZE // 4)
    np.testing.assert_allclose(found[inner, inner], wanted[inner, inner], atol=1e-12)


@pytest.mark.parametrize("gutter", [0, 1, 3])
@pytest.mark.parametrize("name", ["dense", "negative", "cascade", "taps"])
def test_no_light_leaves_its_chart(kernels, name, gutter):
    """A lit chart beside a dark one, at odd columns: both are as they would be alone."""
    cover, charts = np.ones((23, 41)), np.zeros((23, 41), int)
    cover[:, 21 : 21 + gutter], charts[:, 21:] = 0.0, 1
    light, per_mm = (
        np.where(charts == 0, 1.0, 0.0)[..., None].repeat(3, -1),
        np.full((23, 41, 2), 2),
    )
    found, _ = blur_texture(light, Level.of_map(cover, per_mm, charts), kernels[name])
    assert (found[:, 21:] == 0.0).all()
    alone, _ = blur_texture(light, Level.of_map(cover * (charts == 0), per_mm), kernels[name])
    np.testing.assert_array_equal(found, alone)
    np.testing.assert_allclose(found[:, :21], alone[:1, :1].repeat(23, 0).repeat(21, 1))


def squares(apart=0.0, split=False):
    """A square that looks along z beside one with normals along -z, ``apart`` in the texture."""
    x, y = np.array([0.0, 1, 1, 0, 2, 3, 3, 2]), np.array([0.0, 0, 1, 1] * 2)
    u = np.where(x < 2.0, x * (0.5 - apart), 0.5 + apart + (x - 2.0) * (0.5 - apart))
    points, uv = np.stack((80.0 * x - 120.0, 80.0 * y - 40.0, 0.0 * x), 1), np.stack((u, y), 1)
    faces = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])
    normals = np.where(x[:, None] < 2.0, [[0.0, 0.0, 1.0]], [[0.0, 0.0, -1.0]])
    if split:
        points, uv, normals, faces = (
            *(each[faces].reshape(12, -1) for each in (points, uv, normals)),
            np.arange(12).reshape(4, 3),
        )
    return Mesh("squares", points, uv, faces, normals)


@pytest.mark.parametrize("distance", [400.0, 2000.0])
def test_a_dark_chart_is_black_beside_a_lit_one(kernels, distance):
    """From far away too, where a pixel shows halved maps."""
    frame = frame_of(
        squares(), kernels["cascade"], ambient=0.0, map_size=61, camera=Camera(distance, 40, 60)
    )
    is_dark = frame.drawn.covered & (frame.drawn.faces >= 2)
    is_lit = frame.drawn.covered & (frame.drawn.faces < 2)
    assert is_dark.any()
    assert (frame.picture[is_dark] == 0.0).all()
    assert (frame.picture[is_lit] > 0.0).all()


def test_a_chart_is_a_piece_of_the_surface_and_of_the_texture():
    one = squares()
    assert charts_of(one).tolist() == [0, 0, 1, 1]  # they touch in the texture alone
    assert charts_of(squares(split=True)).tolist() == [0, 0, 1, 1]  # each triangle with its corners
    assert charts_of(cube()).tolist() == np.repeat(np.arange(6), 2).tolist()
    away = Mesh("x", np.add(one.positions_mm, [0.0, 0.0, 1e9]), one.uv, one.faces)
    assert charts_of(away).tolist() == [0, 0, 1, 1]
    assert charts_of(sphere()).max() == 0
    mirrored = Mesh(
        "x", one.positions_mm, np.concatenate((one.uv[:4], one.uv[[1, 0, 3, 2]])), one.faces
    )
    assert charts_of(mirrored).tolist() == [0, 0, 1, 1]  # the diagonals cross
    faces = np.array([[0, 1, 2], [0, 2, 3], [5, 4, 7], [5, 7, 6]])
    stacked = Mesh("x", one.positions_mm, mirrored.uv, faces)
    assert charts_of(stacked).max() == 0  # two halves that share their texels


@pytest.mark.parametrize("noise", [0.0, 1e-8])
def test_an_edge_that_is_split_on_one_side_alone_is_no_border(noise):
    # A square, cut at u = .5: one triangle's edge on the left, two on the right, no corner between.
    uv = np.array([[0, 0.5], [0.5, 0], [0.5, 1], [0.5, 0], [0.5, 0.4], [0.5, 1], [1, 0.4]], float)
    uv[3:6, 0] += noise
    points = np.c_[100.0 * uv, np.zeros(7)]
    mesh = Mesh("cut", points, uv, np.array([[0, 1, 2], [3, 6, 4], [4, 6, 5]]))
    assert charts_of(mesh).tolist() == [0, 0, 0]


@pytest.mark.parametrize("name", ["dense", "negative", "cascade", "taps"])
def test_constant_light_stays_constant_on_any_chart(kernels, name):
    rng = np.random.default_rng(3)
    cover = np.zeros((40, 40))
    cover[5:20, 3:30] = 1.0
    cover[25:36, 10:38] = rng.integers(0, 2, (11, 28))
    charts = np.where(np.arange(40) < 15, 0, rng.integers(1, 3, (40, 40)))
    level = Level.of_map(cover, rng.uniform(0.5, 4.0, (40, 40, 2)), charts)
    found, _ = blur_texture(np.full((40, 40, 3), 0.7), level, kernels[name])
    kernel = kernels[name]
    energy = kernel.energy * getattr(kernel, "scale", 1.0)
    np.testing.assert_allclose(
        found[cover > 0.0], np.broadcast_to(0.7 * energy, found[cover > 0.0].shape)
    )
    assert (found[cover == 0.0] == 0.0).all()


def test_texels_of_half_the_size_have_half_the_kernel(kernels):
    """A table for .5 mm on texels of .25 mm: each fetch lies twice as many texels away."""
    kernel = kernels["dense"]
    light = spots(2 * SIZE)
    level = Level.of_map(
        np.ones((2 * SIZE, 2 * SIZE)), np.full((2 * SIZE, 2 * SIZE, 2), 2.0 / PITCH)
    )
    found, count = blur_texture(light, level, kernel)
    even = light[::2, ::2]
    wanted, _ = blur_texture(
        even, Level.of_map(np.ones((SIZE, SIZE)), np.full((SIZE, SIZE, 2), 1.0 / PITCH)), kernel
    )
    np.testing.assert_allclose(found[::2, ::2], wanted, atol=1e-12)
    assert count == 4 * (2 * SIZE) ** 2


def test_stretch_is_by_axis(kernels):
    """Texels twice as long down as to the right: the picture of square ones, every second row."""
    light = np.zeros((64, 128, 3))
    light[32, 64] = 1.0
    rates = np.stack((np.full((64, 128), 0.5 / PITCH), np.full((64, 128), 1.0 / PITCH)), axis=-1)
    found, _ = blur_texture(light, Level.of_map(np.ones((64, 128)), rates), kernels["dense"])
    column, row = found[:, 64, 0], found[32, :, 0]
    x = np.arange(128) - 64.0
    wide = np.sqrt((row * x**2).sum() / row.sum())
    y = np.arange(64) - 32.0
    high = np.sqrt((column * y**2).sum() / column.sum())
    assert high < 0.75 * wide


def camera_for_quad(size):
    """One pixel a texel: a quad of 48 mm on ``size`` pixels."""
    distance = 48.0 / (2.0 * np.tan(np.radians(15.0)))
    return Camera(distance, size, size)


def test_a_quad_gives_the_picture_of_the_image_space_renderer(kernels):
    """Head-on, one texel a pixel; light by its point light's cosine, without shadows or gloss."""
    size = SIZE
    mesh, camera = quad(size * PITCH), camera_for_quad(size)
    assert camera.mm_per_pixel == pytest.approx(PITCH)
    light = PointLight((30.0, 10.0, 60.0), (1.0, 0.8, 0.6), 60.0)
    frame = render_texture(
        mesh, (0.0, 0.0, 0.0), camera, [light], kernels["dense"], map_size=size, specular=False
    )
    centres = (np.arange(size) + 0.5 - 0.5 * size) * PITCH
    x, y = np.meshgrid(centres, -centres)
    away = np.stack((30.0 - x, 10.0 - y, np.full_like(x, 60.0)), axis=-1)
    square = (away**2).sum(axis=-1)
    irradiance = 0.05 + (60.0 * 60.0**2 / square**1.5)[..., None] * np.array(light.power)
    wanted = render(irradiance, kernels["dense"], border="mirror")
    inner = slice(12, -12)
    np.testing.assert_allclose(frame.picture[inner, inner], wanted[inner, inner], rtol=2e-3)


def test_the_frustums_planes_are_those_of_clipped_vertices():
    """P^T Pi in eye coordinates against multiplication of every point by P."""
    camera = Camera(900.0, 120, 200, near_mm=300.0, far_mm=1500.0)
    points = np.random.default_rng(2).uniform(-900.0, 900.0, (5000, 3))
    eye = np.concatenate((camera.to_eye(points), np.ones((5000, 1))), axis=1)
    clip = eye @ camera.projection.T
    for margin in (1.0, 1.3):
        w = clip[:, 3]
        inside = (np.abs(clip[:, :2]) <= margin * w[:, None]).all(axis=1)
        inside &= np.abs(clip[:, 2]) <= w
        found = (eye @ camera.eye_planes(margin).T >= 0.0).all(axis=1)
        np.testing.assert_array_equal(found, inside)
        assert 0.02 < inside.mean() < 0.5
    assert CLIP_PLANES[:, 3].tolist() == [1.0] * 6


def test_places_on_the_screen_are_those_of_the_projection():
    camera = Camera(900.0, 120, 200)
    points = np.random.default_rng(2).uniform(-200.0, 200.0, (50, 3))
    clip = np.concatenate((camera.to_eye(points), np.ones((50, 1))), 1) @ camera.projection.T
    seen = clip[:, :2] / clip[:, 3:]
    x, y, depth = camera.to_screen(points).T
    np.testing.assert_allclose(x, 100.0 * (1.0 + seen[:, 0]))
    np.testing.assert_allclose(y, 60.0 * (1.0 - seen[:, 1]))
    np.testing.assert_allclose(depth, 900.0 - points[:, 2])


def test_pixels_show_the_nearest_triangle_and_its_place():
    """Random triangles against a test of each pixel's ray with each of them."""
    rng = np.random.default_rng(5)
    points = rng.uniform(-60.0, 60.0, (30, 3))
    mesh = Mesh("x", points, rng.uniform(0.0, 1.0, (30, 2)), np.arange(30).reshape(-1, 3))
    camera = Camera(400.0, 24, 32)
    drawn = draw_view(mesh, (0.0, 0.0, 0.0), camera)
    half = np.tan(np.radians(15.0))
    for row, column in itertools.product(range(24), range(32)):
        ray = np.array([(column + 0.5 - 16) / 12 * half, (12 - row - 0.5) / 12 * half, -1.0])
        best = (np.inf, -1, None)
        for f, (a, b, c) in enumerate(mesh.positions_mm[mesh.faces]):
            matrix = np.stack((b - a, c - a, -ray), axis=1)
            s, t, depth = np.linalg.solve(matrix, camera.eye_mm - a)
            if min(s, t, 1.0 - s - t) >= 0.0 and depth < best[0]:
                best = (depth, f, (s, t))
        if best[1] < 0:
            assert drawn.copies[row, column] == -1
            continue
        assert drawn.faces[row, column] == best[1]
        np.testing.assert_allclose(drawn.places[row, column], best[2], atol=1e-9)


def frame_of(mesh, kernel, savings=None, **settings):
    usual = {"map_size": 96, "shadow_size": 128, "specular": False}
    lights = [PointLight((300.0, 200.0, 600.0), (1.0, 0.8, 0.6), 700.0)]
    camera = settings.pop("camera", Camera(500.0, 60, 80))
    offsets = settings.pop("offsets_mm", (0.0, 0.0, 0.0))
    savings = savings or Savings()
    return render_texture(
        mesh, offsets, camera, lights, kernel, savings=savings, **usual | settings
    )


@pytest.mark.parametrize("mesh", [sphere(), cube()], ids=["sphere", "cube"])
@pytest.mark.parametrize("normals", ["vertex", "face"])
def test_culling_at_180_degrees_is_none(kernels, mesh, normals):
    whole = frame_of(mesh, kernels["cascade"])
    found = frame_of(mesh, kernels["cascade"], Savings(culled=normals, cull_degrees=180.0))
    np.testing.assert_array_equal(found.picture, whole.picture)
    assert found.texels_lit == whole.texels_lit
    assert found.texels_convolved == whole.texels_convolved


def test_culling_keeps_the_picture_far_from_outlines(kernels):
    """Of a sphere of 50 mm: kernels of 5 mm see nothing of what is beyond 105 degrees."""
    mesh = sphere(50.0, rows=48, columns=96)
    whole = frame_of(mesh, kernels["dense"], map_size=256)
    for normals in ("vertex", "face"):
        found = frame_of(mesh, kernels["dense"], Savings(culled=normals), map_size=256)
        # By the camera's angle a sphere shows less than a half: about 42 % with 105 degrees more.
        share = found.texels_lit / whole.texels_lit
        assert 0.5 < share < 0.65
        np.testing.assert_allclose(found.picture, whole.picture, atol=1e-12)


def test_texels_outside_of_the_frustum_are_left_out(kernels):
    mesh = sphere(50.0, rows=48, columns=96)
    camera = Camera(200.0, 60, 60, fov_degrees=20.0)  # 70 mm of 100 are seen
    whole = frame_of(mesh, kernels["dense"], camera=camera, map_size=192)
    for margin in (1.0, 1.3):
        found = frame_of(
            mesh,
            kernels["dense"],
            Savings(clipped=True, margin=margin),
            camera=camera,
            map_size=192,
        )
        assert found.texels_lit < 0.75 * whole.texels_lit
        inner = slice(9, -9)  # a kernel's 5 mm are 4 to 6 pixels
        np.testing.assert_allclose(
            found.picture[inner, inner], whole.picture[inner, inner], atol=1e-12
        )
        if margin > 1.2:
            np.testing.assert_allclose(found.picture, whole.picture, atol=1e-12)


def test_a_map_shrinks_with_the_distance_of_its_nearest_corner(kernels):
    mesh = sphere()
    for distance, size in ((480.0, 96), (1000.0, 47), (5000.0, 9)):
        found = frame_of(
            mesh, kernels["cascade"], Savings(by_depth=True), camera=Camera(distance, 30, 40)
        )
        nearest = np.linalg.norm([50.0, 50.0, distance - 50.0])
        assert found.map_sizes == (round(96 * min(450.0 / nearest, 1.0)),)
        assert abs(found.map_sizes[0] - size) <= 2


def test_energy_is_conserved_over_a_closed_map(kernels):
    """Light of one spot on a sphere's texture comes out again, by area, but for the stretch."""
    mesh = sphere(50.0, rows=96, columns=192)
    size = 512
    texels = draw_texture(mesh, size)
    per_mm = np.zeros((size, size, 2))
    here = texels.covered
    per_mm[here] = size / mesh.stretch_mm()[texels.faces[here]][:, ::-1]
    light = np.zeros((size, size, 3))
    light[240:272, 200:264] = 1.0  # at the equator, where texels are even
    found, _ = blur_texture(light, Level.of_map(here.astype(float), per_mm), kernels["dense"])
    area = np.zeros((size, size, 1))
    area[here, 0] = 1.0 / per_mm[here].prod(axis=1)
    ratio = (found * area).sum(axis=(0, 1)) / (light * area).sum(axis=(0, 1))
    np.testing.assert_allclose(ratio, kernels["dense"].energy, rtol=2e-3)


def test_a_shadow_falls_where_a_ray_is_stopped():
    """A small quad before a large one: the shadow of similar triangles."""
    big, small = quad(200.0), quad(20.0)
    both = Mesh(
        "two",
        np.concatenate((big.positions_mm, small.positions_mm + np.array([0.0, 0.0, 50.0]))),
        np.concatenate((0.5 * big.uv, 0.5 + 0.5 * small.uv)),
        np.concatenate((big.faces, small.faces + 4)),
    )
    shadow = draw_shadows(PointLight((0.0, 0.0, 150.0), (1.0,), 150.0), both, (0.0, 0.0, 0.0), 512)
    x = np.linspace(-40.0, 40.0, 161)
    points = np.stack((x, np.zeros_like(x), np.zeros_like(x)), axis=1)
    normals = np.broadcast_to([0.0, 0.0, 1.0], points.shape)
    lit = irradiance_at(points, np.ascontiguousarray(normals), [shadow], 0.0, 1)[:, 0]
    edge = 10.0 * 150.0 / 100.0
    assert (lit[np.abs(x) < edge - 1.0] == 0.0).all()
    far = np.abs(x) > edge + 1.0
    square = x[far] ** 2 + 150.0**2
    np.testing.assert_allclose(lit[far], 150.0**3 / square**1.5, rtol=1e-12)


def test_specular_light_is_that_of_the_listing():
    """GPU Gems 3, listing 14-2, a point at a time, with pi for a radiant exitance."""
    rng = np.random.default_rng(7)
    points = rng.uniform(-5.0, 5.0, (40, 3))
    normals = rng.standard_normal((40, 3)) + np.array([0.0, 0.0, 2.0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    eye = np.array([0.0, 0.0, 700.0])
    light = PointLight((400.0, 100.0, 600.0), (1.0, 0.5), 800.0)
    far = quad(1.0)
    shadow = draw_shadows(light, far, (0.0, 900.0, 0.0), 16)
    found = specular_at(points, normals, [shadow], eye, 2)
    for point, n, seen in zip(points, normals, found, strict=True):
        away = np.array(light.place_mm) - point
        to_light, to_eye = away / np.linalg.norm(away), eye - point
        to_eye = to_eye / np.linalg.norm(to_eye)
        h = to_light + to_eye
        half = h / np.linalg.norm(h)
        cosine = n @ half
        tangent = np.tan(np.arccos(min(cosine, 1.0)))
        beckmann = np.exp(-((tangent / 0.3) ** 2)) / (np.pi * 0.3**2 * cosine**4)
        fresnel = 0.028 + 0.972 * (1.0 - half @ to_eye) ** 5
        lit = 0.18 * max(n @ to_light, 0.0) * beckmann * fresnel / (h @ h)
        arriving = 800.0**2 / (away @ away) * np.array([1.0, 0.5])
        np.testing.assert_allclose(seen, np.pi * lit * arriving, rtol=1e-9, atol=1e-15)


def test_seams_are_not_dark(kernels):
    """Ambient light alone on a cube of six charts: all that is seen is the energy."""
    frame = render_texture(
        cube(),
        (0.0, 0.0, 0.0),
        Camera(400.0, 60, 60),
        [],
        kernels["cascade"],
        map_size=96,
        ambient=0.5,
    )
    seen = frame.picture[frame.drawn.covered]
    np.testing.assert_allclose(seen, np.broadcast_to(0.5 * kernels["cascade"].energy, seen.shape))


def test_threads_and_copies_change_nothing(kernels):
    mesh = sphere()
    alone = frame_of(mesh, kernels["cascade"], threads=1)
    np.testing.assert_array_equal(
        frame_of(mesh, kernels["cascade"], threads=2).picture, alone.picture
    )
    behind = frame_of(mesh, kernels["cascade"], offsets_mm=[(0, 0, 0), (0, 0, -4000.0)])
    assert behind.texels_lit == 2 * alone.texels_lit
    assert len(behind.map_sizes) == 2


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"map_size": 4}, "map_size = 4"),
        ({"map_size": True}, "map_size = True"),
        ({"ambient": -1.0}, "ambient = -1"),
        ({"ambient": np.nan}, "ambient = nan"),
    ],
)
def test_settings_that_are_wrong_are_refused_in_one_line(kernels, changes, said):
    with pytest.raises(RenderError) as caught:
        frame_of(sphere(), kernels["cascade"], **changes)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_no_light_is_refused(kernels):
    camera, dark = Camera(200.0, 8, 8), dataclasses.replace(LIGHT, power=(0.0,))
    for lights in ([], [dark]):
        with pytest.raises(RenderError, match="no light"):
            render_texture(quad(), (0, 0, 0), camera, lights, kernels["cascade"], ambient=0.0)
    for changes in ({"power": (-1.0,)}, {"place_mm": (0.0, np.nan, 0.0)}, {"reference_mm": 0.0}):
        with pytest.raises(RenderError):
            dataclasses.replace(LIGHT, **changes)
    for changes in ({"culled": "edge"}, {"cull_degrees": 80.0}, {"margin": 0.0}):
        with pytest.raises(RenderError):
            Savings(**changes)


def test_six_gaussians_of_the_paper_are_twelve_passes(profile):
    """The six Gaussians of d'Eon, each blurred from the one before."""
    chain = fit_result(profile, "gaussian-chain", blur="published", mm_per_pixel=PITCH).kernel
    flat = Level.of_map(np.ones((8, 8)), np.full((8, 8, 2), 1.0 / PITCH))
    assert blur_texture(np.ones((8, 8, 3)), flat, chain)[1] == 12 * 64
