"""A tour of the presets, each with a question and a control to answer it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Stop:
    """A stop of the tour; the title of the preset describes it.

    Attributes:
        preset: Its name.
        question: Question for the user.
        control: Dotted key of the parameter to change.
    """

    preset: str
    question: str
    control: str


TOUR = (
    Stop("paper-case-1", "Does a lighter object slip less?", "object.mass"),
    Stop(
        "paper-case-2",
        "What if the initial estimate of friction on the left were lower?",
        "estimates.0.initial",
    ),
    Stop(
        "composite-case-2",
        "How far does the left fingertip slip on a smoother face?",
        "fingers.0.friction",
    ),
    Stop(
        "composite-case-2-noisy",
        "How much noise in the measured velocities can the hand tolerate?",
        "sensing.velocity_noise",
    ),
    Stop("poured-mass", "Does pressing harder than needed prevent it?", "controller.grip_safety"),
    Stop("wet-patch", "How slippery may the low-friction patch be?", "patches.0.friction_factor"),
    Stop("shake-test", "What is the lowest friction that holds it?", "fingers.0.friction"),
    Stop("three-fingers", "What does the finger below contribute?", "fingers.2.friction"),
    Stop("tilted-object", "How smooth may its left face be?", "fingers.0.friction"),
    Stop("unequal-fingers", "Which finger slips first if it is heavier?", "object.mass"),
    Stop("wide-object", "Does its moment of inertia matter?", "object.inertia"),
    Stop("gripper-lift", "Which grip force does it need?", "controller.grip_force"),
    Stop("parallel-gripper", "Which grip stops the pivot?", "controller.grip_force"),
    Stop("spatial-bottle", "Which grip keeps it from turning?", "controller.grip_force"),
    Stop("trifinger", "Up to which mass is it held?", "object.mass"),
    Stop("spatial-prism", "Does a lighter object slip less in space, too?", "object.mass"),
    Stop(
        "spatial-pyramid",
        "What does the paper's pyramid hide? Choose the cone.",
        "simulation.friction",
    ),
    Stop(
        "spatial-unknown-friction",
        "How far do the fingertips slide if one face is rougher?",
        "fingers.0.friction",
    ),
    Stop("spatial-composite", "Up to which mass is it held?", "object.mass"),
    Stop(
        "spatial-composite-noisy",
        "How much noise in the measured velocities can a spatial hand tolerate?",
        "sensing.velocity_noise",
    ),
    Stop("spatial-box", "What if the thumb's face is smooth?", "fingers.0.friction"),
    Stop("sliding-block", "Which friction halves the distance?", "support.friction"),
    Stop("spinning-slide", "Does it spin longer on a smoother support?", "support.friction"),
    Stop("push-slider", "Does a rougher rail delay the start?", "rail.friction"),
    Stop("drag-slider", "How rough must the object be?", "finger.friction"),
)
