"""Predictions of real slides: half of them are fitted, the other half predicted.

`python -m benchmarks reality --data DIR` reads a clone of DAIRLab/contact-nets.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares, minimize, minimize_scalar

from benchmarks.real_slides import Floats, Slide, read_slides
from benchmarks.report import Table, table_of_rows
from benchmarks.slide_models import MODELS, UNIFORM_RADIUS, Model, stop_distance

PAGE = "reality.md"
SEED = 1
FIRST_SAMPLES = 8
"""Number of samples that determine the start of a predicted slide: 47 ms."""

SPINNING = 1.5
"""Initial spin above which a slide counts as spinning [rad/s]."""

SIGMA_POSITION, SIGMA_YAW = 2e-4, 3e-3  # [m], [rad]
RADII = (0.010, 0.030, 0.036, 0.040, 0.050, 0.070)
START_FRICTION, START_RADIUS = 0.21, 0.036
LARGEST_RADIUS = 0.1


class Fitted(NamedTuple):
    """One friction and one radius for all slides."""

    friction: float
    radius: float


class Prediction(NamedTuple):
    """Errors of one slide that was not fitted.

    Attributes:
        stop: Relative error of the stop distance.
        yaw: Error of the final yaw [rad].
        spins: Whether it spins at the start.
    """

    stop: float
    yaw: float
    spins: bool


def run(data: Path | None = None, seed: int = SEED) -> list[Table]:
    """The tables ``reality-models``, ``reality-radius`` and ``reality-plain``."""
    if data is None:
        raise SystemExit("reality needs --data DIR, a clone of DAIRLab/contact-nets")
    slides = read_slides(data)
    resting = [slide for slide in slides if slide.rests]
    fitted, held_out = halves(resting, seed)
    spinning = [slide for slide in slides if spins(slide)]
    return [_plain(slides, resting), _models(fitted, held_out), _radius(spinning)]


def halves(slides: Sequence[Slide], seed: int) -> tuple[list[Slide], list[Slide]]:
    """Half of the slides for fitting, and the other half for prediction."""
    order = np.random.default_rng(seed).permutation(len(slides))
    middle = len(slides) // 2
    return [slides[k] for k in order[:middle]], [slides[k] for k in order[middle:]]


def spins(slide: Slide) -> bool:
    """True if a slide spins at its start."""
    return bool(abs(slide.spin[0]) > SPINNING)


def residuals(
    slide: Slide, model: Model, start: Floats, friction: float, radius: float, samples: int
) -> Floats:
    """Model minus data in standard deviations, of the first samples; the offset is fitted.

    Args:
        slide: The slide.
        model: The model.
        start: Velocity and spin at the first sample [m/s, m/s, rad/s].
        friction: Friction.
        radius: Radius c [m].
        samples: Number of samples.
    """
    speed = max(float(np.hypot(start[0], start[1])), 1e-9)
    path, angle = model(speed, float(start[2]), friction, radius).at(slide.times[:samples])
    position = path[:, None] * start[:2] / speed - slide.position[:samples]
    yaw = angle - slide.yaw[:samples]
    apart = np.column_stack([position, yaw])
    apart -= apart.mean(axis=0)
    return (apart / [SIGMA_POSITION, SIGMA_POSITION, SIGMA_YAW]).ravel()


def fit_slide(
    slide: Slide,
    model: Model,
    radius: float,
    friction: float | None = None,
    samples: int | None = None,
) -> tuple[Floats, float]:
    """The start that fits a slide, or its first samples, and chi-squared per degree of freedom.

    The start is followed by the friction if none is given.
    """
    count = len(slide.times) if samples is None else min(samples, len(slide.times))
    # As the authors derived it.
    start = [*slide.velocity[0], slide.spin[0]]
    first = start if friction is not None else [*start, START_FRICTION]
    free = len(first)

    def apart(values: Floats) -> Floats:
        chosen = float(values[3]) if friction is None else friction
        return residuals(slide, model, values[:3], chosen, radius, count)

    limits = ([-np.inf, -np.inf, -np.inf, 0.01][:free], [np.inf, np.inf, np.inf, 1.0][:free])
    scale = [0.1, 0.1, 1.0, 0.1][:free]
    found = least_squares(apart, first, diff_step=1e-4, x_scale=scale, bounds=limits)
    # Three offsets are fitted too.
    return found.x, 2.0 * float(found.cost) / (3 * count - 3 - free)


def fit_all(slides: Sequence[Slide], model: Model, *, with_radius: bool) -> Fitted:
    """One friction, and optionally one radius, for all slides.

    The sum of the square roots of chi-squared is minimized: frictions of slides differ by more than
    the noise, and a few of them would dominate a sum of squares.
    """

    def misfit(friction: float, radius: float) -> float:
        if not (0.02 < friction < 1.0 and 1e-3 < radius < LARGEST_RADIUS):
            return float("inf")
        return sum(np.sqrt(fit_slide(slide, model, radius, friction)[1]) for slide in slides)

    if not with_radius:
        one = partial(misfit, radius=START_RADIUS)
        found = minimize_scalar(one, bounds=(0.15, 0.3), method="bounded", options={"xatol": 1e-4})
        return Fitted(float(found.x), 0.0)
    first = np.array([[START_FRICTION, START_RADIUS], [0.2, START_RADIUS], [START_FRICTION, 0.03]])
    options = {"initial_simplex": first, "xatol": 1e-4, "fatol": 1e-2, "maxfev": 40}
    found = minimize(lambda v: misfit(*v), first[0], method="Nelder-Mead", options=options)
    return Fitted(*map(float, found.x))


def predict(slide: Slide, model: Model, fitted: Fitted) -> Prediction:
    """The errors of a model for a slide whose first samples are given."""
    start, _ = fit_slide(slide, model, fitted.radius, fitted.friction, FIRST_SAMPLES)
    speed = float(np.hypot(start[0], start[1]))
    path, angle = model(speed, float(start[2]), *fitted).at(slide.times[-1:])
    turn = float(angle[0] - (slide.yaw[-1] - slide.yaw[0]))
    return Prediction(float(path[0]) / _length(slide) - 1.0, turn, spins(slide))


def _plain(slides: Sequence[Slide], resting: Sequence[Slide]) -> Table:
    """Friction from the slope of the speed, and the simple formula of the stop distance."""
    low, middle, high = np.percentile([_slope(slide) for slide in slides], [25, 50, 75])
    model = MODELS["no spin coupling"]
    lengths = np.array([_length(slide) for slide in resting])
    speeds = (float(np.hypot(*slide.velocity[0])) for slide in resting)
    errors = [stop_distance(model, speed, 0.0, middle, 0.0) for speed in speeds] / lengths - 1.0
    error = f"{100.0 * float(np.median(np.abs(errors))):.1f} %"
    rows = (
        ("slides", str(len(slides))),
        ("of these with their end at rest", str(len(resting))),
        ("of these that start with a spin above 1.5 rad/s", str(sum(map(spins, slides)))),
        ("median length of those that come to rest", f"{1e3 * np.median(lengths):.1f} mm"),
        ("friction from the slope of the speed, median", f"{middle:.3f}"),
        ("its quartiles", f"{low:.3f} … {high:.3f}"),
        ("error of the stop distance u² / (2 mu g), median, in sample", error),
    )
    return Table("reality-plain", ("quantity", "value"), rows, page=PAGE)


def _slope(slide: Slide) -> float:
    """Friction from a straight line through the speed of the moving samples."""
    speed = np.hypot(*slide.velocity.T)
    moving = np.argmin(speed > 0.06) if (speed <= 0.06).any() else len(speed)
    count = max(int(moving), 4)
    slope = np.polyfit(slide.times[:count], speed[:count], 1)[0]
    return float(-slope / 9.81)


def _length(slide: Slide) -> float:
    return float(np.linalg.norm(slide.position[-1] - slide.position[0]))


def _models(fitted: Sequence[Slide], held_out: Sequence[Slide]) -> Table:
    rows = {}
    for name, model in MODELS.items():
        found = fit_all(fitted, model, with_radius=name != "no spin coupling")
        predicted = [predict(slide, model, found) for slide in held_out]
        spinning = [each for each in predicted if each.spins]
        stop, spun = (np.median(np.abs([p.stop for p in each])) for each in (predicted, spinning))
        turned = np.degrees(np.median(np.abs([each.yaw for each in spinning])))
        rows[name] = {
            "friction": f"{found.friction:.4f}",
            "radius": f"{1e3 * found.radius:.1f} mm" if found.radius else "–",
            "stop distance": f"{100.0 * stop:.1f} %",
            "of spinning slides": f"{100.0 * spun:.1f} %",
            "final yaw of spinning slides": f"{turned:.1f}°",
        }
    note = (
        f"{len(fitted)} slides fitted, {len(held_out)} predicted, of which "
        f"{sum(map(spins, held_out))} spin; the start of each is known from its first "
        f"{FIRST_SAMPLES} samples. Medians of absolute errors."
    )
    return table_of_rows("reality-models", "model", rows, note, page=PAGE)


def _radius(slides: Sequence[Slide]) -> Table:
    """Every spinning slide with separate friction and start, for several radii."""
    rows = []
    for radius in RADII:
        fits = (
            [fit_slide(slide, MODELS[name], radius)[1] for slide in slides]
            for name in ("ellipsoid", "independent torsion")
        )
        rows.append((f"{1e3 * radius:.0f} mm", *(f"{np.median(chi):.2f}" for chi in fits)))
    note = (
        f"{len(slides)} spinning slides, each with its own friction and start, noise of 0.2 mm and "
        f"3 mrad. A uniform pressure over the face has a radius of {1e3 * UNIFORM_RADIUS:.1f} mm."
    )
    heads = ("radius c", "ellipsoid, median chi²/freedom", "independent torsion")
    return Table("reality-radius", heads, tuple(rows), (note,), page=PAGE)
