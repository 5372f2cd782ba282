"""Request and response schemas of fits; numbers are finite, in SI units."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field

from slipgrasp.core.fit.problem import NUISANCES
from slipgrasp.core.fit.profile import ParameterClass
from slipgrasp.core.fit.progress import FitProgress
from slipgrasp.recordings.fit.request import FitRequest
from slipgrasp.server.addresses import fit_path, run_path
from slipgrasp.server.fits.progress import FitStatus
from slipgrasp.server.jobs.job import StudyState
from slipgrasp.server.runs.scenarios import ChangedValues, ChosenScenario, changed_scenario

Key = Annotated[str, Field(min_length=1, max_length=200)]
RunId = Annotated[str, Field(min_length=1, max_length=60)]
Noise = Annotated[float, Field(gt=0.0, lt=1e9, allow_inf_nan=False)]


class FitCreate(BaseModel):
    """Request of a fit: a recording, a scenario and free parameters."""

    model_config = ConfigDict(
        extra="forbid",
        strict=True,
        json_schema_extra={
            "example": {
                "recording": "mcx1k2v8a7qz",
                "scenario": "paper-case-1",
                "free": ["object.mass", "fingers.0.friction=0.1..0.6"],
                "signals": {"object_pose": 2e-4, "slip": 2e-4},
            }
        },
    )

    recording: Annotated[RunId, Field(description="id of measured data or of a run")]
    scenario: ChosenScenario
    values: ChangedValues = {}
    free: Annotated[
        list[Key],
        Field(
            min_length=1,
            max_length=12,
            description="dotted keys of numbers to find, such as object.mass or "
            "object.mass=0.5..2 with the range to search",
        ),
    ]
    signals: Annotated[
        dict[str, Noise],
        Field(
            min_length=1,
            max_length=100,
            description="signal or column to the standard deviation of its noise, in its SI unit",
        ),
    ]
    nuisance: Annotated[
        list[Literal["delay", "force_bias"]],
        Field(max_length=len(NUISANCES), description="measurement errors to find in addition"),
    ] = []
    held_out: Annotated[
        list[RunId], Field(max_length=20, description="ids of other recordings to predict")
    ] = []
    compare: Annotated[
        list[Annotated[list[Key], Field(min_length=1, max_length=12)]],
        Field(max_length=8, description="additional free parameters, for each other model"),
    ] = []
    starts: Annotated[int, Field(ge=1, le=256, description="number of starts")] = 20
    twins: Annotated[
        int, Field(ge=0, le=1000, description="number of synthetic twins to fit in addition")
    ] = 0
    seed: Annotated[int, Field(ge=0, le=2**53 - 1, description="seed of starts and twins")] = 0
    title: Annotated[str, Field(max_length=200)] = ""

    def to_request(self) -> FitRequest:
        """Converts to a `FitRequest`, without reading the recordings.

        Raises:
            ScenarioError: With one entry per invalid field of the scenario.
        """
        return FitRequest(
            recording=self.recording,
            scenario=changed_scenario(self.scenario, self.values).to_mapping(),
            free=tuple(self.free),
            signals=self.signals,
            nuisance=tuple(self.nuisance),
            held_out=tuple(self.held_out),
            compare=tuple(map(tuple, self.compare)),
            starts=self.starts,
            twins=self.twins,
            seed=self.seed,
            title=self.title,
        )


class FitParameterPublic(BaseModel):
    """A parameter of a fit; while the fit runs, its preliminary results."""

    key: str
    unit: str = Field(
        default="", description="SI unit, 1 for pure numbers; empty until the fit ends"
    )
    value: float | None = Field(
        default=None, description="the estimate; null unless the data bound it on both sides"
    )
    low: float | None = Field(default=None, description="lower end of the 95 % interval")
    high: float | None = Field(default=None, description="upper end of the 95 % interval")
    kind: ParameterClass | None = Field(
        default=None,
        alias="class",
        description="sides bounded by the data; null until the fit ends",
    )
    best: float | None = Field(default=None, description="value in the best run so far")
    note: str = ""
    profile: list[tuple[float, float]] = Field(
        default=[], description="values, and the rise of chi-squared there, so far"
    )


class FitPublic(BaseModel):
    """A fit without its parameters, for lists."""

    id: str
    state: StudyState
    title: str
    recording: str = Field(description="id of the fitted recording")
    free: list[str] = Field(description="free parameters, as requested")
    signals: dict[str, float]
    created: str = Field(description="ISO 8601, UTC")
    stage: str = Field(description="current stage; empty unless the fit runs")
    share: float = Field(description="completed fraction of the stage, 0 to 1")
    evaluations: int = Field(description="number of different runs so far, without those of twins")
    message: str = Field(description="reason for a failure; otherwise empty")
    links: dict[str, str]

    @classmethod
    def from_status(cls, status: FitStatus) -> Self:
        """Creates the response from the status of a fit."""
        return cls(**_facts(status))


class FitStartsPublic(BaseModel):
    """Results of the searches from several starts."""

    count: int
    same_minimum: int = Field(description="number of starts that reached the lowest minimum")
    chi_squared: list[float]


class FitProgressPublic(FitPublic):
    """A fit with its results so far."""

    parameters: dict[str, FitParameterPublic]
    threshold: float | None = Field(
        description="rise of chi-squared at the ends of the intervals; null until profiles begin"
    )
    starts: FitStartsPublic | None = Field(description="null until the fit ends")
    held_out: list[dict[str, Any]] = Field(description="predictions; see the JSON report")
    explains: bool | None = Field(
        description="whether the residuals are as small as the noise; null until the fit ends"
    )

    @classmethod
    def from_fit(cls, status: FitStatus, report: dict[str, Any] | None) -> Self:
        """Creates the response from the status of a fit and its report.

        Args:
            status: Status of the fit.
            report: Report of the fit, once it is complete.
        """
        if report is None:
            found = {"starts": None, "held_out": [], "explains": None}
            found["parameters"] = _parameters_so_far(status.progress)
            return cls(**_facts(status), **found, threshold=status.progress.threshold)
        parameters = {
            key: FitParameterPublic.model_validate({**each, "best": report["best"][key]})
            for key, each in report["parameters"].items()
        }
        names = ("starts", "held_out", "explains", "threshold")
        return cls(**_facts(status), parameters=parameters, **{n: report[n] for n in names})


class FitsPublic(BaseModel):
    """A page of the fits, and the number of fits on all pages."""

    data: list[FitPublic]
    count: int
    links: dict[str, str] = Field(description="next and prev, if such a page exists")


def _parameters_so_far(progress: FitProgress) -> dict[str, FitParameterPublic]:
    profiles = progress.profiles or {}
    return {
        key: FitParameterPublic(key=key, best=value, profile=list(profiles.get(key, ())))
        for key, value in (progress.best or {}).items()
    }


def _facts(status: FitStatus) -> dict[str, Any]:
    request, progress = status.stored.request, status.progress
    return {
        "id": status.stored.id,
        "state": status.state,
        "title": request.title,
        "recording": request.recording,
        "free": list(request.free),
        "signals": request.signals,
        "created": status.stored.created,
        "stage": progress.stage if status.state is StudyState.RUNNING else "",
        "share": progress.share,
        "evaluations": progress.evaluations,
        "message": status.message,
        "links": _links(status),
    }


def _links(status: FitStatus) -> dict[str, str]:
    own = fit_path(status.stored.id)
    links = {
        "self": own,
        "events": f"{own}/events",
        "data": run_path(status.stored.request.recording),
    }
    if status.state is StudyState.COMPLETED:
        files = {"report": "report.html", "report_json": "report.json", "study": "recording"}
        return links | {name: f"{own}/{file}" for name, file in files.items()}
    if status.state is StudyState.CANCELLED:
        return links
    return links | {"cancel": f"{own}/cancel"}
