"""Intents about the scenario that is asked for."""

from __future__ import annotations

from dataclasses import dataclass

from web.intents.intent import Intent

__all__ = ["ChoosePreset", "ResetScenario", "SetParameter"]


@dataclass(frozen=True, slots=True)
class SetParameter(Intent):
    """The user moved the knob of a parameter; its value is not validated yet."""

    key: str
    value: float | int | str | list[float]

    @property
    def subject(self) -> object:
        """The parameter."""
        return self.key


@dataclass(frozen=True, slots=True)
class ChoosePreset(Intent):
    """The user chose another scenario to start from."""

    name: str


@dataclass(frozen=True, slots=True)
class ResetScenario(Intent):
    """The user wants the preset back as it comes."""
