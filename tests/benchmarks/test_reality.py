"""Real slides: the reader of their files, the closed forms, and fits of synthetic ones."""

import pickle
import sys
import types

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from benchmarks.__main__ import main
from benchmarks.real_slides import HALF_WIDTH, RATE, Slide, cut_slides, read_slides, read_tensor
from benchmarks.reality import fit_all, halves, predict, run
from benchmarks.slide_models import (
    GRAVITY,
    GYRATION,
    MODELS,
    UNIFORM_RADIUS,
    slide_on_ellipsoid,
    stop_distance,
)


def write_tensor(path, states, monkeypatch, kind="DoubleStorage"):
    """Writes states in torch's old format of files, without torch."""
    torch, utils = types.ModuleType("torch"), types.ModuleType("torch._utils")

    def rebuild(*parts):
        return parts

    rebuild.__module__, rebuild.__qualname__ = "torch._utils", "_rebuild_tensor_v2"
    storage = type(kind, (), {"__module__": "torch"})
    utils._rebuild_tensor_v2 = rebuild
    setattr(torch, kind, storage)
    count = states.size

    class Tensor:
        def __reduce__(self):
            size = (1, *states.shape)
            return rebuild, (Key(), 0, size, (count, states.shape[1], 1), False, {})

    class Key:
        pass

    class Pickler(pickle.Pickler):
        def persistent_id(self, value):
            is_key = isinstance(value, Key)
            return ("storage", storage, "7", "cpu", count, None) if is_key else None

    with monkeypatch.context() as patched, path.open("wb") as stream:
        patched.setitem(sys.modules, "torch", torch)
        patched.setitem(sys.modules, "torch._utils", utils)
        for head in (0x1950A86A20F9469CFC6C, 1001, {"little_endian": True}):
            pickle.dump(head, stream, 2)
        Pickler(stream, 2).dump(Tensor())
        pickle.dump(["7"], stream, 2)
        stream.write(count.to_bytes(8, "little") + states.astype("<f8").tobytes())


def toss_of(speed, spin, friction=0.21, radius=0.036, direction=0.3, flight=5, rest=6):
    """States of a toss: some samples in the air, a slide on one face, and rest."""
    motion = slide_on_ellipsoid(speed, spin, friction, radius)
    times = np.arange(int(motion.times[-1] * RATE) + rest) / RATE
    path, angle = motion.at(times)
    states = np.zeros((flight + len(times), 19))
    states[:, 3] = 1.0
    states[:flight, 2] = 2.0
    on = states[flight:]
    along = np.array([np.cos(direction), np.sin(direction)])
    on[:, :2] = (0.1 + path[:, None] * along) / HALF_WIDTH
    on[:, 2] = 1.0
    on[:, 3], on[:, 6] = np.cos(0.5 * angle + 0.2), np.sin(0.5 * angle + 0.2)
    on[:, 7:9] = np.gradient(path, times)[:, None] * along / HALF_WIDTH
    on[:, 12] = np.gradient(angle, times)
    return states, path, angle


def test_a_tensor_is_read_back_without_torch(tmp_path, monkeypatch):
    states = np.random.default_rng(0).normal(size=(40, 19))
    write_tensor(tmp_path / "0.pt", states, monkeypatch)

    assert np.array_equal(read_tensor(tmp_path / "0.pt"), states)


def test_a_file_that_names_anything_else_is_refused_and_not_run(tmp_path, monkeypatch):
    states = np.zeros((3, 19))
    write_tensor(tmp_path / "float.pt", states, monkeypatch, kind="FloatStorage")
    with pytest.raises(ValueError, match=r"torch\.FloatStorage"):
        read_tensor(tmp_path / "float.pt")
    (tmp_path / "evil.pt").write_bytes(pickle.dumps(print, 2))
    with pytest.raises(ValueError, match="print"):
        read_tensor(tmp_path / "evil.pt")
    write_tensor(tmp_path / "cut.pt", states, monkeypatch)
    data = (tmp_path / "cut.pt").read_bytes()
    for size in (len(data) - 1, len(data) // 2, 20, 0):
        (tmp_path / "cut.pt").write_bytes(data[:size])
        with pytest.raises(ValueError, match=r"end is missing|no tensor|not one whole"):
            read_tensor(tmp_path / "cut.pt")


def test_a_slide_is_cut_from_a_toss_with_its_way_and_angle(tmp_path, monkeypatch):
    states, path, angle = toss_of(0.5, 2.0)
    folder = tmp_path / "data" / "tosses_processed"
    folder.mkdir(parents=True)
    write_tensor(folder / "12.pt", states, monkeypatch)
    (slide,) = read_slides(tmp_path)

    assert (slide.toss, slide.rests, len(slide.times)) == (12, True, len(path))
    assert np.hypot(*(slide.position - slide.position[0]).T) == pytest.approx(path)
    assert slide.yaw == pytest.approx(angle)
    tilted = states.copy()
    tilted[:, 3:7] = [np.cos(0.03), np.sin(0.03), 0.0, 0.0]
    assert cut_slides(0, tilted) == []
    short = states[:12]
    assert cut_slides(0, short) == []


def test_a_folder_without_tosses_is_refused_in_a_sentence(tmp_path):
    with pytest.raises(ValueError, match="clone of DAIRLab/contact-nets"):
        read_slides(tmp_path)
    with pytest.raises(SystemExit, match="--data"):
        run()


def test_the_folder_of_the_data_is_for_reality(capsys):
    with pytest.raises(SystemExit):
        main(["speed", "--data", "folder"])
    assert "--data DIR is for reality" in capsys.readouterr().err


def test_with_the_radius_of_gyration_speed_and_spin_decrease_together():
    u, w, mu = 0.6, 5.0, 0.2
    s = np.hypot(u, GYRATION * w)
    motion = slide_on_ellipsoid(u, w, mu, GYRATION)

    # s decreases evenly, so it lasts s / (mu g) at mean speed u / 2.
    duration = s / (mu * GRAVITY)
    assert motion.times[-1] == pytest.approx(duration, rel=1e-3)
    assert motion.path[-1] == pytest.approx(0.5 * u * duration, rel=1e-3)
    assert motion.angle[-1] == pytest.approx(0.5 * w * duration, rel=1e-3)
    halfway, turned = motion.at(np.array([0.5 * duration]))
    assert halfway[0] == pytest.approx(0.75 * motion.path[-1], rel=1e-3)
    assert turned[0] == pytest.approx(0.75 * motion.angle[-1], rel=1e-3)


@pytest.mark.parametrize("radius", [0.01, 0.036, 0.05])
def test_the_quadrature_agrees_with_the_integrated_equations_of_motion(radius):
    mu, start = 0.21, [0.5, -4.0, 0.0, 0.0]

    def rates(_, state):
        u, w = state[:2]
        s = np.hypot(u, radius * w)
        torsion = mu * GRAVITY * (radius / GYRATION) ** 2 * w / s
        return [-mu * GRAVITY * u / s, -torsion, u, w]

    motion = slide_on_ellipsoid(0.5, -4.0, mu, radius)
    times = np.linspace(0.0, 0.9 * motion.times[-1], 20)
    exact = solve_ivp(rates, (0.0, times[-1]), start, t_eval=times, rtol=1e-10, atol=1e-13)
    path, angle = motion.at(times)

    assert path == pytest.approx(exact.y[2], abs=2e-5)
    assert angle == pytest.approx(exact.y[3], abs=3e-4)


def test_without_spin_every_model_stops_after_the_plain_distance():
    for model in MODELS.values():
        assert stop_distance(model, 0.5, 0.0, 0.2, 0.03) == pytest.approx(
            0.25 / (2 * 0.2 * GRAVITY), rel=1e-3
        )


def test_the_radius_of_a_uniform_square_is_the_mean_distance_from_its_centre():
    places = (np.arange(2000) + 0.5) / 2000 - 0.5
    x, y = np.meshgrid(places, places)
    mean = np.hypot(x, y).mean() * 2.0 * HALF_WIDTH

    assert pytest.approx(mean, rel=1e-3) == UNIFORM_RADIUS


@pytest.fixture(scope="module")
def slides() -> list[Slide]:
    """Slides of one friction and radius, with a little noise."""
    rng = np.random.default_rng(4)
    found: list[Slide] = []
    for _ in range(12):
        speed, spin, way = rng.uniform(0.3, 0.7), rng.uniform(-4.0, 4.0), rng.uniform(0.0, 6.0)
        (slide,) = cut_slides(0, toss_of(speed, spin, direction=way)[0])
        slide.position[:] += 1e-5 * rng.standard_normal(slide.position.shape)
        found.append(slide)
    return found


@pytest.mark.slow
def test_friction_and_radius_of_synthetic_slides_are_found_and_predict_the_others(slides):
    fitted, held_out = halves(slides, seed=1)
    assert not {id(slide) for slide in fitted} & {id(slide) for slide in held_out}
    found = fit_all(fitted, MODELS["ellipsoid"], with_radius=True)
    plain = fit_all(fitted, MODELS["no spin coupling"], with_radius=False)

    assert found.friction == pytest.approx(0.21, rel=0.01)
    assert found.radius == pytest.approx(0.036, rel=0.02)
    errors = [predict(slide, MODELS["ellipsoid"], found) for slide in held_out]
    others = [predict(slide, MODELS["no spin coupling"], plain) for slide in held_out]
    assert max(abs(each.stop) for each in errors) < 0.02
    assert np.median([abs(e.yaw) for e in errors]) < 0.3 * np.median([abs(o.yaw) for o in others])
