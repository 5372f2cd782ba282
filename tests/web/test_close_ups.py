"""The close-ups over the view: what is sent for them, and how a real Chromium shows them."""

from __future__ import annotations

import itertools
from base64 import b64encode
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, scenario_from_mapping, with_values
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.core.words.phrases import length_words
from slipgrasp.scene.skeleton import contacts_of
from slipgrasp.web.model.appearance import Appearance
from slipgrasp.web.model.colours import glow
from slipgrasp.web.model.sampling import Sampler
from slipgrasp.web.model.surfaces import surfaces_for
from slipgrasp.web.page.routes import STATIC_PATH
from slipgrasp.web.scene.close_ups import arrays_of, facts_of, packed
from slipgrasp.web.scene.layout import lay_out
from tests.waiting import wait_until
from tests.web.driving import FRAMES, choose_scenario, pause, pause_at
from tests.web.packets import unpacked

ATTITUDES = 8
SEEN = """() => {
    const host = document.querySelector(".sg-overlay").getBoundingClientRect();
    const panel = document.querySelector(".sg-transport").closest("[data-floating-window]");
    const boxOf = (element) => {
        const {left, top, right, bottom} = element.getBoundingClientRect();
        return [left, top, right, bottom];
    };
    const closeUps = [...document.querySelectorAll(".sg-close-up")].map((element) => ({
        box: boxOf(element),
        rim: boxOf(element.querySelector(".sg-lens circle")),
        turns: [...element.querySelectorAll("*")].map((one) => {
            const {b, c} = one.getScreenCTM?.() ?? {b: 0, c: 0};
            return one.closest("[transform^=rotate]") ? 0 : Math.abs(b) + Math.abs(c);
        }),
        words: [...element.querySelectorAll("text")].map((text) => text.textContent),
    }));
    const free = [host.left, host.top, host.right, panel.getBoundingClientRect().top];
    return {free, closeUps, object: objectBox(host)};
    // Where corners of the object are drawn, by the camera of viser.
    function objectBox(host) {
        const {nodeRefFromName, camera} = window.__viserMutable;
        const isObject = ([name, node]) => node && name.endsWith("/object/part0");
        const [, object] = Object.entries(nodeRefFromName).find(isObject);
        const seen = [];
        object.traverse(({geometry, matrixWorld}) => {
            const corners = geometry?.attributes.position;
            for (let i = 0; i < (corners?.count ?? 0); i += 1) {
                const at = camera.position.clone().fromBufferAttribute(corners, i);
                const {x, y} = at.applyMatrix4(matrixWorld).project(camera);
                seen.push([host.left + 0.5 * (1 + x) * host.width,
                    host.top + 0.5 * (1 - y) * host.height]);
            }
        });
        const [xs, ys] = [0, 1].map((k) => seen.map((corner) => corner[k]));
        return [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
    }
}"""
LOOK_FROM = """([azimuth, elevation, share]) => {
    const {camera, cameraControl, requestRender} = window.__viserMutable;
    const {x, y, z} = cameraControl.getTarget(camera.position.clone());
    const distance = share * (window.firstDistance ??= cameraControl.distance);
    const across = distance * Math.cos(elevation);
    cameraControl.setLookAt(
        x + across * Math.sin(azimuth), y + distance * Math.sin(elevation),
        z + across * Math.cos(azimuth), x, y, z, false);
    requestRender();
}"""
DRAWN = """async ([packet, index, time, folder]) => {
    const {ContactRun} = await import(`${folder}/contact_run.js`);
    const {Lens} = await import(`${folder}/close_up.js`);
    const run = ContactRun.unpack(Uint8Array.from(atob(packet), (each) => each.charCodeAt(0)));
    const named = [-1, 0, 1, 2].map((phase) => [phase, `phase ${phase}`]);
    const colours = {phases: Object.fromEntries(named)};
    const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    const {facts} = run;
    const lens = new Lens(facts, facts.contacts[index], colours, svg);
    lens.draw(run.at(index, time), time, 0, 0, 100);
    const {ball, force, motion, cone, hands, patches, trails, stub, ghost} = lens.parts;
    const paths = {force, motion, limit: cone.edge, estimated: cone.estimated,
        hand: hands?.now, stub, trail: trails[0], ahead: trails[1], ghost: ghost.line};
    const written = (path) => (path?.getAttribute("d") ?? "").match(/-?[0-9.]+/g) ?? [];
    const numbers = Object.entries(paths).map(([name, path]) => [name, written(path).map(Number)]);
    return {
        paths: Object.fromEntries(numbers),
        ball: ["cx", "cy", "fill"].map((name) => ball.getAttribute(name)),
        wet: patches.map((patch) => patch.getAttribute("visibility") !== "hidden"),
    };
}"""
SLIPS = """async ([facts, arrays, times, folder]) => {
    const {ContactRun} = await import(`${folder}/contact_run.js`);
    const typed = Object.fromEntries(
        Object.entries(arrays).map(([name, values]) => [name, Float64Array.from(values)]));
    const run = new ContactRun({reach: 1, contacts: [{}], ...facts}, typed);
    return times.map((time) => run.at(0, time).slip[0]);
}"""
# For every picture: the time, and of the first fingertip the colours of its close-up and its ball.
WATCH_PICTURES = """() => {
    const {scene, nodeRefFromName, nodePoseData} = window.__viserMutable;
    const ball = Object.keys(nodeRefFromName).find((name) => name.endsWith("/contact0/tip/ball"));
    const arrows = ball.replace(/ball$/, "arrows");
    const rim = document.querySelector(".sg-close-up .sg-lens > circle:last-child");
    let draw = scene.onAfterRender;
    window.sgPictures = [];
    const watched = () => {
        draw();
        if (!window.sgPictures) return;
        let hex = "";
        nodeRefFromName[ball].traverse(({material}) => (hex ||= material?.color.getHexString()));
        const parts = hex.match(/../g).map((each) => parseInt(each, 16));
        const time = nodePoseData["/clock"].position[0];
        const arrow = [];
        nodeRefFromName[arrows].traverse((node) => {
            if (!node.setColorAt) return;
            const {r, g, b} = node.getColorAt(0, node.material.color.clone());
            arrow.push([r, g, b].map((each) => Math.round(255 * each)));
        });
        window.sgPictures.push([time, rim.getAttribute("stroke"), `rgba(${parts},1)`, arrow]);
    };
    Object.defineProperty(scene, "onAfterRender", {
        configurable: true, get: () => watched, set: (given) => (draw = given)});
}"""
TAKE_PICTURES = "[sgPictures, sgPictures = null][0]"
PAINTED = "(text) => ['fill', 'stroke'].map((name) => getComputedStyle(text)[name])"


@pytest.fixture(scope="module")
def prism() -> RunResult:
    return simulate(with_values(load_scenario("spatial-prism"), {"simulation.duration": 0.2}))


def test_a_packet_has_every_sample_of_every_contact_at_round_offsets(prism: RunResult) -> None:
    layout = lay_out(prism)
    facts = facts_of(prism, prism, layout, Appearance(force_scale=2.0), "/object")
    read, arrays = unpacked(packed(facts, arrays_of(prism, prism, layout)))
    assert [each["name"] for each in read["contacts"]] == list(prism.scenario.finger_names)
    assert read["force"] == layout.full.force / 2.0
    assert all(each["ghost"] for each in read["contacts"])
    trace = prism.trace
    np.testing.assert_array_equal(arrays["times"], trace.times)
    np.testing.assert_array_equal(arrays["phase"], trace.phase)
    slip = trace.slip.reshape(len(trace), 3, 2).astype(np.float32)
    np.testing.assert_array_equal(arrays["slip"], slip)
    np.testing.assert_array_equal(arrays["ghostSlip"], slip)
    assert np.isnan(arrays["estimate"]).all()
    assert "link" not in arrays


def test_a_packet_of_a_long_run_has_every_change_of_phase(case_1: RunResult) -> None:
    trace = case_1.trace
    rows = np.arange(12_000) * len(trace) // 12_000
    long = trace[rows]
    layout = lay_out(case_1)
    result = replace(case_1, trace=long)
    arrays = arrays_of(result, None, layout)
    assert not facts_of(result, None, layout, Appearance(), "/object")["skipsChanges"]
    assert 4000 <= len(arrays["times"]) < 4200
    at = {round(float(time), 9) for time in arrays["times"]}
    changes = np.flatnonzero((np.diff(long.phase, axis=0) != 0).any(axis=1))
    assert len(changes) > 0
    assert {round(float(long.times[k]), 9) for k in (*changes, *(changes + 1))} <= at


def drawn(
    page: Page, result: RunResult, contact: int, time: float, ghost: RunResult | None = None
) -> dict[str, Any]:
    """The lens of a contact at a time: numbers of its paths, in its radius."""
    layout = lay_out(result)
    facts = facts_of(result, ghost, layout, Appearance(), "/object")
    packet = b64encode(packed(facts, arrays_of(result, ghost, layout))).decode()
    lens = page.evaluate(DRAWN, [packet, contact, time, STATIC_PATH])
    lens["paths"] = {name: np.reshape(path, (-1, 2)) for name, path in lens["paths"].items()}
    return lens


def arrow(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Tail and vector of an arrow."""
    tail = 0.5 * (corners[0] + corners[-1])
    return tail, corners[3] - tail


@pytest.mark.browser
def test_a_planar_lens_shows_slip_force_and_cone_in_the_axes_of_the_object(
    blank: Page, case_2: RunResult
) -> None:
    time, layout = 0.1, lay_out(case_2)
    states = Sampler(case_2.trace).at(time).states
    for i, contact in enumerate(contacts_of(case_2.scenario)):
        lens = drawn(blank, case_2, i, time)
        tangent, inward = -contact.axes[:2, 0], contact.axes[:2, 1]
        slip = states.slip[0, i, 0] / layout.reach
        tail, force = arrow(lens["paths"]["force"])
        np.testing.assert_allclose(tail, slip * tangent, atol=1e-3)
        across = -states.tangential_force[0, i, 0] * tangent + states.normal_force[0, i] * inward
        full = 0.65 / layout.full.force * across
        share = np.linalg.norm(force) / np.linalg.norm(full)
        np.testing.assert_allclose(force, share * full, atol=1e-3)
        # What would end outside of the lens ends at its rim.
        assert share == pytest.approx(1.0, abs=2e-3) or np.hypot(*(tail + force)) > 0.968
        assert share < 1.002
        edge = lens["paths"]["limit"]
        np.testing.assert_allclose(edge[1], tail, atol=1e-3)
        sides = edge[[0, 2]] - edge[1]
        np.testing.assert_allclose(np.linalg.norm(sides, axis=1), 0.58, atol=1e-3)
        # A fingertip that slips has its force on the edge of its cone.
        assert states.phases[0, i] != ContactPhase.STICK
        slopes = (sides @ tangent) / (sides @ inward)
        assert np.abs(slopes - (force @ tangent) / (force @ inward)).min() < 0.01
        reached = lens["paths"]["trail" if slip < 0 else "ahead"]
        np.testing.assert_allclose(reached[1] - reached[0], slip * tangent, atol=1e-3)
        assert lens["ball"][2] == f"phase {int(states.phases[0, i])}"


# Slip t³ until 2 s, and then none: the last stretch begins without a sample at the phase change.
CUBIC = {
    "times": [0.0, 1.0, 2.0, 3.0, 4.0],
    "slip": [0.0, 1.0, 8.0, 9.0, 9.0],
    "velocity": [0.0, 3.0, 12.0, 0.0, 0.0],
    "phase": [1, 1, 1, 0, 0],
    **{name: [0.0] * 5 for name in ("tangential", "normal", "friction", "estimate")},
}


@pytest.mark.browser
def test_slip_between_samples_follows_the_slip_velocity_except_over_a_phase_change(
    blank: Page,
) -> None:
    def slips(times: list[float], **facts: bool) -> list[float]:
        return blank.evaluate(SLIPS, [facts, CUBIC, times, STATIC_PATH])

    assert slips(CUBIC["times"]) == CUBIC["slip"]
    within = [0.1, 0.5, 1.25, 1.9]
    np.testing.assert_allclose(slips(within), np.power(within, 3), rtol=1e-12)
    assert slips([2.25, 3.5]) == [8.25, 9.0]
    # A thinned run may have changed its phase and back between two samples.
    assert slips([1.5], skipsChanges=True) == [4.5]


@pytest.mark.browser
def test_the_last_link_of_a_finger_below_comes_from_below(blank: Page) -> None:
    mapping = load_scenario("three-fingers").to_mapping()
    mapping["simulation"]["duration"] = 0.05
    run = simulate(scenario_from_mapping(mapping))
    for i, contact in enumerate(contacts_of(run.scenario)):
        start, end = drawn(blank, run, i, 0.04)["paths"]["stub"]
        assert (end - start) @ contact.axes[:2, 1] < -0.3
        assert np.hypot(*end) == pytest.approx(0.92, abs=2e-3)


@pytest.mark.browser
@pytest.mark.parametrize("preset", ["spatial-prism", "spatial-pyramid", "parallel-gripper"])
def test_friction_of_a_spatial_contact_ends_on_its_limit_while_it_slips(
    blank: Page, preset: str
) -> None:
    run = simulate(with_values(load_scenario(preset), {"simulation.duration": 0.2}))
    layout = lay_out(run)
    lens, states = drawn(blank, run, 0, 0.05), Sampler(run.trace).at(0.05).states
    tip = states.slip[0, 0, ::-1] / layout.reach
    tail, friction = arrow(lens["paths"]["force"])
    np.testing.assert_allclose(tail, tip, atol=2e-3)
    scale = 0.5 / layout.limit
    np.testing.assert_allclose(friction, -scale * states.tangential_force[0, 0, ::-1], atol=2e-3)
    limit = lens["paths"]["limit"] - tip
    norm = np.inf if run.scenario.friction_cone == "pyramid" else 2
    radius = np.linalg.norm(limit, norm, axis=1)
    np.testing.assert_allclose(radius, radius[0], atol=2e-3)
    assert np.linalg.norm(friction, norm) == pytest.approx(radius[0], abs=4e-3)
    _, motion = arrow(lens["paths"]["motion"])
    if norm == 2:
        along = motion / np.linalg.norm(motion)
        assert along @ friction == pytest.approx(np.linalg.norm(friction), rel=1e-3)


@pytest.mark.browser
def test_the_hand_of_a_pad_turns_clockwise_with_a_positive_spin(blank: Page) -> None:
    run = simulate(with_values(load_scenario("parallel-gripper"), {"simulation.duration": 0.6}))
    layout = lay_out(run)
    for time in (0.0, 0.55):
        spin = float(Sampler(run.trace).at(time).states.spin[0, 0])
        hand = drawn(blank, run, 0, time)["paths"]["hand"][-1]
        radius = 0.015 / layout.reach
        np.testing.assert_allclose(hand, radius * np.array([np.sin(spin), np.cos(spin)]), atol=2e-3)
    assert abs(spin) > 0.2
    assert 0.3 < radius < 1.0


@pytest.mark.browser
def test_patches_and_the_ghost_are_drawn_while_they_are_there(
    blank: Page, prism: RunResult
) -> None:
    wet = {"patches.0.face": "side-0", "patches.0.end_time": 0.1, "patches.1.face": "side-0"}
    run = replace(prism, scenario=with_values(prism.scenario, wet))
    assert drawn(blank, run, 0, 0.05)["wet"] == [True, True]
    assert drawn(blank, run, 0, 0.15)["wet"] == [False, True]
    assert drawn(blank, run, 1, 0.05)["wet"] == []
    assert len(drawn(blank, prism, 0, 0.05)["paths"]["ghost"]) == 0
    pale = drawn(blank, prism, 0, 0.05, prism)["paths"]["ghost"][-1]
    slip = Sampler(prism.trace).at(0.05).states.slip[0, 0, ::-1]
    np.testing.assert_allclose(pale, slip / lay_out(prism).reach, atol=2e-3)


def seen(page: Page) -> dict[str, Any]:
    page.evaluate(FRAMES)
    return page.evaluate(SEEN)


def shows(page: Page, preset: str, time: float) -> None:
    choose_scenario(page, preset)
    page.locator(".sg-origin", has_text=preset).wait_for()
    pause_at(page, time)


def captions(result: RunResult, time: float) -> list[list[str]]:
    """What close-ups say about a run at a time."""
    states = Sampler(result.trace).at(time).states
    told = []
    for i, name in enumerate(result.scenario.finger_names):
        slips = states.phases[0, i] != ContactPhase.STICK
        force = float(
            np.hypot(np.linalg.norm(states.tangential_force[0, i]), states.normal_force[0, i])
        )
        slip = length_words(float(np.linalg.norm(states.slip[0, i].astype(np.float32))))
        title = f"{name.capitalize()} {'SLIPS' if slips else 'sticks'}"
        told.append([title, f"slip {slip}", f"force {force:.1f} N"])
    return told


@pytest.mark.browser
@pytest.mark.slow
@pytest.mark.parametrize(("preset", "time"), [("paper-case-1", 0.05), ("spatial-prism", 0.05)])
def test_close_ups_are_upright_apart_and_on_screen_from_wherever_one_looks(
    seen_page: Page, preset: str, time: float
) -> None:
    page = seen_page
    shows(page, preset, time)
    result = simulate(load_scenario(preset))
    expected = captions(result, time)
    drawn = np.random.default_rng(36)
    for _ in range(ATTITUDES):
        look = [drawn.uniform(-np.pi, np.pi), drawn.uniform(-1.4, 1.4), drawn.uniform(0.6, 2.0)]
        page.evaluate(LOOK_FROM, look)
        view = seen(page)
        left, top, right, bottom = view["free"]
        assert len(view["closeUps"]) == len(expected)
        for each, words in zip(view["closeUps"], expected, strict=True):
            assert max(each["turns"]) < 1e-6, look
            x0, y0, x1, y1 = each["rim"]
            assert x1 - x0 == pytest.approx(y1 - y0, abs=0.1) and x1 - x0 > 20.0, look
            x0, y0, x1, y1 = each["box"]
            assert left <= x0 and top <= y0 and x1 <= right and y1 <= bottom, look
            title, _scale, *numbers = each["words"]
            assert [title, *numbers[:2]] == words, look
        boxes = [each["box"] for each in view["closeUps"]]
        if look[2] >= 1.0:
            # From nearer, the object may leave no space.
            boxes.append(view["object"])
        for a, b in itertools.combinations(boxes, 2):
            assert a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1], look


@pytest.mark.browser
@pytest.mark.slow
def test_fingertips_arrows_and_close_ups_change_colour_in_the_same_picture(seen_page: Page) -> None:
    page = seen_page
    shows(page, "paper-case-1", 0.08)  # shortly before the slips end
    page.get_by_label("speed", exact=True).select_option("1/16")
    page.evaluate(WATCH_PICTURES)
    page.get_by_role("button", name="Play", exact=True).dispatch_event("click")

    def has_restarted() -> bool:
        times = [time for time, *_ in page.evaluate("window.sgPictures")]
        return bool((np.diff(times) < 0.0).any())

    wait_until(has_restarted, "the run does not start again")
    pictures = page.evaluate(TAKE_PICTURES)
    pause(page)
    assert len({close_up for _, close_up, *_ in pictures}) == 2
    assert [each for each in pictures if each[1] != each[2]] == []
    for time, close_up, _, arrow in pictures:
        colour = [int(part) for part in close_up.removeprefix("rgba(").split(",")[:3]]
        assert arrow == [list(glow(tuple(colour)))] * 2, time  # the shaft and the head


@pytest.mark.browser
@pytest.mark.slow
def test_a_close_up_enlarges_by_mouse_or_keyboard_and_says_more(seen_page: Page) -> None:
    page = seen_page
    shows(page, "parallel-gripper", 0.5)
    buttons = page.get_by_role("button", name="Enlarge the close-up of")
    assert buttons.count() == 2
    buttons.first.click()
    large = page.locator(".sg-large")
    assert large.get_by_text("limit surface").count() == 1
    assert large.get_by_text("of at most").count() == 2
    page.get_by_role("button", name="Close", exact=True).click()
    assert large.count() == 0
    buttons.last.focus()
    page.keyboard.press("Enter")
    assert large.count() == 1
    page.keyboard.press("Escape")
    assert large.count() == 0


@pytest.mark.browser
@pytest.mark.slow
def test_words_of_a_close_up_can_be_selected_without_turning_the_camera(seen_page: Page) -> None:
    page = seen_page
    shows(page, "paper-case-1", 0.05)
    page.evaluate(FRAMES)
    place = "window.__viserMutable.camera.position.toArray()"
    before = page.evaluate(place)
    box = page.locator(".sg-close-up").first.get_by_text("force").bounding_box()
    assert box is not None
    middle = box["y"] + 0.5 * box["height"]
    page.mouse.move(box["x"] + 0.2 * box["width"], middle)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.9 * box["width"], middle, steps=4)
    page.mouse.up()
    assert "rce" in page.evaluate("getSelection().toString()")
    assert page.evaluate(place) == before


@pytest.mark.browser
@pytest.mark.slow
def test_the_size_of_a_push_is_written_in_the_colours_of_the_page(seen_page: Page) -> None:
    page = seen_page
    shows(page, "paper-case-1", 0.05)
    page.get_by_role("button", name="push", exact=True).click()
    label = page.locator(".sg-labels text").filter(has_text="push 5 N")
    label.wait_for()

    def has_colours(dark: bool) -> bool:
        ink, halo = label.evaluate(PAINTED)
        surfaces = surfaces_for(dark=dark)
        return (ink, halo) == (rgb(surfaces.ink), rgb(surfaces.page))

    wait_until(lambda: has_colours(dark=False), "not those of a light page")
    page.get_by_role("button", name="Picture", exact=True).click()
    page.get_by_label("dark", exact=True).check()
    wait_until(lambda: has_colours(dark=True), "not those of a dark page")
    page.get_by_label("dark", exact=True).uncheck()
    wait_until(lambda: has_colours(dark=False), "not those of a light page again")
    page.get_by_role("button", name="End", exact=True).click()
    wait_until(lambda: label.count() == 0, "the push has ended")


def rgb(colour: tuple[int, int, int]) -> str:
    return f"rgb({', '.join(map(str, colour))})"
