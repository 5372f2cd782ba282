"""Sentences of README and docs/robustness.md against the tables they speak of."""

from functools import cache
from pathlib import Path

from benchmarks.report import read_table

ROOT = Path(__file__).parents[2]


@cache
def text_of(page):
    return (ROOT / page).read_text(encoding="utf-8")


@cache
def words_of(page):
    return " ".join(text_of(page).split())


@cache
def table(page, name):
    """Cells of a table that a benchmark wrote: row, column."""
    heads, *rows = read_table(ROOT / page, name)
    return {row[0]: dict(zip(heads[1:], row[1:], strict=True)) for row in rows}


def held(cell):
    """Share held [%]."""
    return float(cell.split()[0])


def robust(name):
    return table("docs/robustness.md", f"robustness-{name}")


def column(name, law):
    """What a law holds in every world of a table [%]."""
    return {world: held(row[law]) for world, row in robust(name).items()}


# Two claims about the composite law


def claims(name):
    return table("docs/robustness.md", name)


def missing(page, told):
    return [words for words in told if words not in words_of(page)]


def test_the_claims_are_told_with_their_numbers():
    late, noise, hands = (claims(name) for name in ("claim-1", "claim-2", "claim-hands"))
    at = {law: {ms: held(row[law]) for ms, row in late.items()} for law in late["0"]}
    switching = [held(row["30 ms: switches"]) for row in hands.values()]
    holding = [held(row["30 ms: holds"]) for row in hands.values()]
    unaware = [held(row["3 mm/s: 0.3 N expected"]) for row in hands.values()]
    aware = [held(row["3 mm/s: noise of 6 mm/s expected"]) for row in hands.values()]
    median = {law: float(late["50"][law].split("; ")[1].split("/")[0]) for law in at}
    expected, known, _, sums = (
        {mm: held(row[law]) for mm, row in noise.items()} for law in noise["1"]
    )
    told = [
        f"the former retains {at['switches']['30']} % at 30 ms and "
        f"{at['switches']['40']} % at 40 ms, the latter all",
        f"both fail ({at['switches']['50']} and {at['holds']['50']} %)",
        f"the former retains {at['switches, predicts']['40']} % at 40 ms and "
        f"{at['switches, predicts']['50']} % at 50 ms, the latter all at every latency",
        f"The median slip path at 50 ms is then {median['holds, predicts']:.0f} mm with *holds*, "
        f"{median['switches, predicts']:.0f} mm with *switches*",
        f"it holds {expected['1']} % at 1 mm/s, {expected['2']} % at 2 mm/s",
        f"it holds {known['10']} %, with sums {sums['10']} %",
        f"*holds* retains at least {min(holding)} % of the objects",
        f"*switches* {min(switching)} to {max(switching)} %",
        f"{min(aware)} to {max(aware):.0f} % with it, {min(unaware)} to {max(unaware)} % without",
    ]
    assert missing("docs/robustness.md", told) == []
    assert {at["holds"][ms] for ms in ("0", "10", "20", "30", "40")} == {100.0}
    assert set(at["holds, predicts"].values()) == {100.0}
    assert at["switches"]["30"] > 95.0
    assert {known[mm] for mm in ("2", "3", "5")} == {99.8}
    assert {sums[mm] for mm in ("0.5", "1", "2", "3", "5")} == {100.0}
    heavy = "2, links 10 % too heavy in the model"
    assert held(hands[heavy]["30 ms: holds"]) == 100.0


# The comparison of the laws


def shares(fingers, law):
    """What a law holds in every world [%], with prediction where it can be had under latency."""
    prompt, late = robust(fingers), robust(f"{fingers}-late")
    ahead = f"{law}, predicts"
    found = {world: held(row[law]) for world, row in prompt.items()}
    return found | {world: held(row.get(ahead, row[law])) for world, row in late.items()}


def without_prediction(fingers, law):
    return {world: held(row[law]) for world, row in robust(f"{fingers}-late").items()}


def laws_of(fingers):
    return [law for law in next(iter(robust(fingers).values())) if law != "oracle"]


def best_of_others(fingers):
    """The best of all laws but the composite law and the oracle, with prediction or without."""
    rows = {**robust(fingers), **robust(f"{fingers}-late")}
    return {
        world: max(held(cell) for law, cell in row.items() if not law.startswith(("comp", "orac")))
        for world, row in rows.items()
    }


def grip(law, world):
    """Least mu F_n over |F_x| at the end, median."""
    return float(robust("how")[law][world].split("; ")[1])


def test_the_comparison_with_two_fingers_is_told_with_its_numbers():
    reflex, composite = shares("two", "grip reflex"), shares("two", "composite")
    late = "latency 50 ms"
    alone = {law: without_prediction("two", law) for law in laws_of("two")}
    told = [
        f"in {len(composite)} worlds",
        f"the reflex holds at least {min(reflex.values())} %, the composite law at least "
        f"{min(composite.values())} %",
        f"at 30 ms of latency {grip('composite', 'latency 30 ms')} times what friction needs at "
        f"the end, the reflex {grip('grip reflex', 'latency 30 ms')} times",
        f"Without prediction it holds {alone['composite'][late]} %, as theorem 4 does "
        f"({alone['theorem 4'][late]} %), and the reflex {alone['grip reflex'][late]} %; with "
        f"prediction the reflex holds {reflex[late]} %",
    ]
    assert missing("docs/robustness.md", told) == []
    assert composite[late] == 100.0
    for world in ("latency 30 ms", "latency 40 ms"):
        assert alone["composite"][world] == alone["grip reflex"][world] == 100.0
    # "As many": nowhere do the intervals part.
    assert max(composite[world] - reflex[world] for world in composite) < 1.0
    assert max(reflex[world] - composite[world] for world in composite) < 2.0


def test_the_published_laws_are_told_with_their_numbers():
    prompt = robust("two")
    reactive, learned, observer = (
        {world: held(row[law]) for world, row in prompt.items()}
        for law in ("reactive force", "learnt friction", "observed slip")
    )
    late = [
        [without_prediction("two", law)[f"latency {ms} ms"] for ms in (40, 50)]
        for law in ("reactive force", "learnt friction", "observed slip")
    ]
    told = [
        f"the reactive force holds at least {min(reactive.values())} % without latency",
        f"where friction falls ({observer.pop('friction falls by 40 %')} %) and where measured "
        f"forces are off by 2 N ({observer.pop('force bias 2 N')} %)",
        f"presses {grip('learnt friction', 'noise 3 mm/s'):.0f} times harder than needed",
        "At 40 ms of latency they hold {}, {} and {} %".format(*(law[0] for law in late)),
        "at 50 ms {}, {} and {} %".format(*(law[1] for law in late)),
    ]
    assert missing("docs/robustness.md", told) == []
    assert set(learned.values()) == set(observer.values()) == {100.0}


def test_the_comparison_with_more_fingers_is_told_with_its_numbers():
    composite, others = shares("three", "composite"), best_of_others("three")
    alone = min([*without_prediction("three", "composite").values(), *composite.values()])
    four, reflex = shares("more", "composite"), shares("more", "grip reflex")
    told = [
        f"it holds at least {min(composite.values())} % in all {len(composite)} worlds "
        f"(at least {alone} % without prediction), the best of the other laws "
        f"{min(others.values())} to {max(others.values())} %",
        f"the reflex holds all, the composite law at least {min(four.values()):.0f} %",
    ]
    assert missing("docs/robustness.md", told) == []
    assert set(reflex.values()) == {100.0}
    assert all(composite[world] > others[world] for world in composite)


def test_what_the_printed_law_lacks_is_told_with_its_numbers():
    start = {law: held(row["ideal world"]) for law, row in robust("start").items()}
    noisy = {law: held(row["noisy world"]) for law, row in robust("start").items()}
    printed, firm = "theorem-4, as printed", "theorem-4, as printed, first grip 30 N"
    told = [f"the law as printed holds {start[printed]} %", f"30 N holds {start[firm]} %"]
    assert missing("docs/robustness.md", told) == []
    told = [f"the printed law holds {start[printed]} % of them", f"holds {start[firm]} %"]
    assert missing("README.md", told) == []
    assert start["composite"] == noisy["composite"] == 100.0
    assert start["theorem-4"] < start[printed]
    outcomes = next(iter(robust("outcomes").values()))
    assert held(outcomes["held (95 % interval)"]) == start[printed]
