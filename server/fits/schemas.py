"""What the REST interface takes and gives of fits; numbers are SI and finite."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field

from slipgrasp.core.fit.problem import NUISANCES
from slipgrasp.core.fit.profile import ParameterClass
from slipgrasp.core.fit.progress import FitProgress
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import scenario_from_mapping, with_values
from slipgrasp.recordings.fit.request import FitRequest
from slipgrasp.server.addresses import fit_path, run_path
from slipgrasp.server.fits.progress import FitStatus
from slipgrasp.server.jobs.job import StudyState
from slipgrasp.server.paging import Limit, Offset
from slipgrasp.server.runs.scenarios import find_preset

Key = Annotated[str, Field(min_length=1, max_length=200)]
RunId = Annotated[str, Field(min_length=1, max_length=60)]
Noise = Annotated[float, Field(gt=0.0, lt=1e9, allow_inf_nan=False)]


class FitsQuery(BaseModel):
    """Which fits are asked for."""

    model_config = ConfigDict(extra="forbid")

    limit: Limit = 100
    offset: Offset = 0


class FitCreate(BaseModel):
    """Which parameters to find, from which recording."""

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
    scenario: Annotated[
        str | dict[str, Any],
        Field(description="Name of a preset, or a scenario as GET /presets/NAME gives one."),
    ]
    values: Annotated[
        dict[str, Any],
        Field(alias="set", description="Dotted key to value; GET /parameters lists the keys."),
    ] = {}
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
        Field(max_length=len(NUISANCES), description="errors of the measurement to find as well"),
    ] = []
    held_out: Annotated[
        list[RunId], Field(max_length=20, description="ids of other recordings to predict")
    ] = []
    compare: Annotated[
        list[Annotated[list[Key], Field(min_length=1, max_length=12)]],
        Field(max_length=8, description="parameters that are free besides, for each other model"),
    ] = []
    starts: Annotated[int, Field(ge=1, le=256, description="number of starts")] = 20
    twins: Annotated[
        int, Field(ge=0, le=1000, description="number of synthetic twins to fit as well")
    ] = 0
    seed: Annotated[int, Field(ge=0, le=2**53 - 1, description="of starts and twins")] = 0
    title: Annotated[str, Field(max_length=200)] = ""

    def to_request(self) -> FitRequest:
        """The fit that is asked for; its recordings are not looked at.

        Raises:
            ScenarioError: With one entry per wrong field of the scenario.
        """
        return FitRequest(
            recording=self.recording,
            scenario=self._scenario().to_mapping(),
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

    def _scenario(self) -> Scenario:
        if isinstance(self.scenario, dict):
            base = scenario_from_mapping(self.scenario)
        else:
            base = find_preset(self.scenario)
        return with_values(base, self.values) if self.values else base


class FitParameterPublic(BaseModel):
    """A parameter of a fit; while the fit runs only what is known so far."""

    key: str
    unit: str = Field(default="", description="SI unit, 1 for pure numbers; empty until it ends")
    value: float | None = Field(
        default=None, description="the estimate; null unless the data bound it on both sides"
    )
    low: float | None = Field(default=None, description="lower end of the 95 % interval")
    high: float | None = Field(default=None, description="upper end of the 95 % interval")
    kind: ParameterClass | None = Field(
        default=None, alias="class", description="which sides the data bound; null until it ends"
    )
    best: float | None = Field(default=None, description="value in the best run so far")
    note: str = ""
    profile: list[tuple[float, float]] = Field(
        default=[], description="values, and the rise of chi-squared there, so far"
    )


class FitPublic(BaseModel):
    """A fit without its parameters, as lists have it."""

    id: str
    state: StudyState
    title: str
    recording: str = Field(description="id of the recording that is fitted")
    free: list[str] = Field(description="what is found, as it was requested")
    signals: dict[str, float]
    created: str = Field(description="ISO 8601, UTC")
    stage: str = Field(description="what it does; empty unless it runs")
    share: float = Field(description="share of the stage that is done, 0 to 1")
    evaluations: int = Field(description="number of different runs so far, twins apart")
    message: str = Field(description="why it failed; else empty")
    links: dict[str, str]

    @classmethod
    def from_status(cls, status: FitStatus) -> Self:
        """How far a fit is."""
        return cls(**_facts(status))


class FitStartsPublic(BaseModel):
    """How the searches from many starts ended."""

    count: int
    same_minimum: int = Field(description="how many reached the lowest minimum found")
    chi_squared: list[float]


class FitProgressPublic(FitPublic):
    """A fit and what it has found, as far as it is."""

    parameters: dict[str, FitParameterPublic]
    threshold: float | None = Field(
        description="rise of chi-squared at the ends of the intervals; null until profiles begin"
    )
    starts: FitStartsPublic | None = Field(description="null until it ends")
    held_out: list[dict[str, Any]] = Field(description="predictions; see the JSON report")
    explains: bool | None = Field(
        description="whether the residuals are as small as the noise; null until it ends"
    )

    @classmethod
    def from_fit(cls, status: FitStatus, report: dict[str, Any] | None) -> Self:
        """How far a fit is.

        Args:
            status: The fit.
            report: Its report, once it is complete.
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
    """A page of the fits, and how many there are on all pages."""

    data: list[FitPublic]
    count: int
    links: dict[str, str] = Field(description="next and prev, where there is such a page")


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
