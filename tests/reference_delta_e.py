"""Colours and structure by the letter, one pixel at a time: oracles for sssfit.compare."""

from math import atan2, cos, degrees, exp, hypot, radians, sin, sqrt

import numpy as np

# Linear sRGB to XYZ by the primaries of IEC 61966-2-1 (x, y) and D65.
PRIMARIES = ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06))
D65 = (0.3127, 0.3290)


# FLIP's own D65, of more digits.
FLIP_WHITE = (0.950428545, 1.0, 1.088900371)


def xyz(chromaticity):
    x, y = chromaticity
    return np.array([x / y, 1.0, (1.0 - x - y) / y])


def lab(rgb, white=None):
    """CIE 15: L, a, b of a linear sRGB pixel."""
    white = xyz(D65) if white is None else np.array(white)
    columns = np.array([xyz(primary) for primary in PRIMARIES]).T
    rgb_to_xyz = columns * np.linalg.solve(columns, white)

    def f(t):
        return t ** (1 / 3) if t > (6 / 29) ** 3 else t / (3 * (6 / 29) ** 2) + 4 / 29

    x, y, z = (f(t) for t in (rgb_to_xyz @ np.asarray(rgb, dtype=float)) / white)
    return 116 * y - 16, 500 * (x - y), 200 * (y - z)


def delta_e_2000(lab_1, lab_2):
    """Sharma, Wu, Dalal 2005, equations 2 to 22, with their rules for hues."""
    (l_1, a_1, b_1), (l_2, a_2, b_2) = lab_1, lab_2
    c_mean = (hypot(a_1, b_1) + hypot(a_2, b_2)) / 2
    g = 0.5 * (1 - sqrt(c_mean**7 / (c_mean**7 + 25.0**7)))
    c_1, c_2 = hypot((1 + g) * a_1, b_1), hypot((1 + g) * a_2, b_2)
    h_1, h_2 = hue(b_1, (1 + g) * a_1), hue(b_2, (1 + g) * a_2)
    grey = c_1 * c_2 == 0
    turn = 0 if grey else h_2 - h_1
    turn += 360 if turn < -180 else -360 if turn > 180 else 0
    d_l, d_c, d_h = l_2 - l_1, c_2 - c_1, 2 * sqrt(c_1 * c_2) * sin(radians(turn / 2))
    l_bar, c_bar, h_bar = (l_1 + l_2) / 2, (c_1 + c_2) / 2, h_1 + h_2
    if not grey:
        if abs(h_1 - h_2) > 180:
            h_bar += 360 if h_bar < 360 else -360
        h_bar /= 2
    t = 1 - 0.17 * cos(radians(h_bar - 30)) + 0.24 * cos(radians(2 * h_bar))
    t += 0.32 * cos(radians(3 * h_bar + 6)) - 0.20 * cos(radians(4 * h_bar - 63))
    s_l = 1 + 0.015 * (l_bar - 50) ** 2 / sqrt(20 + (l_bar - 50) ** 2)
    s_c, s_h = 1 + 0.045 * c_bar, 1 + 0.015 * c_bar * t
    r_t = -sin(radians(60 * exp(-(((h_bar - 275) / 25) ** 2))))
    r_t *= 2 * sqrt(c_bar**7 / (c_bar**7 + 25.0**7))
    by_l, by_c, by_h = d_l / s_l, d_c / s_c, d_h / s_h
    return sqrt(by_l**2 + by_c**2 + by_h**2 + r_t * by_c * by_h)


def hue(b, a):
    return 0.0 if a == b == 0 else degrees(atan2(b, a)) % 360


def srgb_code(linear):
    return 12.92 * linear if linear <= 0.0031308 else 1.055 * linear ** (1 / 2.4) - 0.055


def ssim(first, second):
    """Wang, Bovik, Sheikh, Simoncelli 2004, equation 13, of code values: every 11 x 11 window."""
    offsets = np.arange(-5, 6)
    window = np.exp(-0.5 * (offsets[:, None] ** 2 + offsets**2) / 1.5**2)
    window /= window.sum()
    c_1, c_2 = 0.01**2, 0.03**2
    values = np.empty((first.shape[0] - 10, first.shape[1] - 10))
    for row, column in np.ndindex(values.shape):
        x = first[row : row + 11, column : column + 11]
        y = second[row : row + 11, column : column + 11]
        mx, my = np.sum(window * x), np.sum(window * y)
        vx, vy = np.sum(window * (x - mx) ** 2), np.sum(window * (y - my) ** 2)
        covariance = np.sum(window * (x - mx) * (y - my))
        values[row, column] = (2 * mx * my + c_1) * (2 * covariance + c_2)
        values[row, column] /= (mx**2 + my**2 + c_1) * (vx + vy + c_2)
    return values


def flip_of_uniform(rgb_1, rgb_2):
    """LDR-FLIP of two pictures of one colour each, where its filters change nothing.

    Andersson and others 2020, section 4: Hunt-adjusted Lab, the distance HyAB to the power 0.7, and
    the remapping that brings 0.4 of the largest distance to 0.95.
    """

    def hunt(rgb):
        lightness, a, b = lab(rgb, FLIP_WHITE)
        return np.array([lightness, 0.01 * lightness * a, 0.01 * lightness * b])

    def distance(one, other):
        difference = hunt(one) - hunt(other)
        return (abs(difference[0]) + hypot(*difference[1:])) ** 0.7

    largest = distance((0, 1, 0), (0, 0, 1))
    found = distance(rgb_1, rgb_2)
    if found < 0.4 * largest:
        return 0.95 * found / (0.4 * largest)
    return 0.95 + 0.05 * (found - 0.4 * largest) / (0.6 * largest)
