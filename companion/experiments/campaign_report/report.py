"""All that a report says, made of a campaign's folder once."""

from dataclasses import dataclass

from companion.experiments.campaign_report.figures import Figures, draw_figures
from companion.experiments.campaign_report.influence import CONTROLLER, Sensitivity, sensitivity
from companion.experiments.campaign_report.read import Campaign
from companion.experiments.campaign_report.summary import Summary, summarise
from companion.experiments.campaign_report.tables import (
    Case,
    Group,
    Reason,
    groups,
    lost_cases,
    reasons,
    unflown_cases,
    worst_tracked,
)

_WORST_OF_EACH = 5


@dataclass(frozen=True, slots=True)
class Report:
    """Of one campaign."""

    campaign: Campaign
    groups: tuple[Group, ...]
    worst: tuple[Case, ...]
    """That tracked to the end: by controller, if several, the worst of each first."""
    lost: tuple[Case, ...]
    unflown: tuple[Case, ...]
    reasons: tuple[Reason, ...]
    sensitivity: Sensitivity
    summary: Summary
    remarks: tuple[str, ...]
    """What stands between the figures and what they seem to say."""

    def draw(self) -> Figures:
        """Its figures; takes seconds."""
        return draw_figures(self.campaign, self.sensitivity)


def make_report(campaign: Campaign) -> Report:
    """Count, rank and sum up."""
    found = sensitivity(campaign)
    grouped = groups(campaign)
    lost = tuple(lost_cases(campaign))
    return Report(
        campaign=campaign,
        groups=grouped,
        worst=tuple(_worst(campaign)),
        lost=lost,
        unflown=tuple(unflown_cases(campaign)),
        reasons=tuple(reasons(lost)),
        sensitivity=found,
        summary=summarise(campaign, grouped, found),
        remarks=_remarks(campaign, found),
    )


def _worst(campaign: Campaign) -> list[Case]:
    flights = campaign.flights
    if campaign.parameter(CONTROLLER) is None:
        return worst_tracked(campaign, flights)
    names = flights.values[CONTROLLER]
    return [
        case
        for name in dict.fromkeys(names.tolist())
        for case in worst_tracked(campaign, flights.take(names == name), _WORST_OF_EACH)
    ]


def _remarks(campaign: Campaign, found: Sensitivity) -> tuple[str, ...]:
    said = []
    lost = int(campaign.flights.lost.sum())
    if lost:
        said.append(
            f"{lost} lost flights have no error: in quantiles, ranks and sensitivity they count as "
            "worse than any that tracked; means are of those that tracked alone."
        )
    if campaign.missing:
        said.append(
            "The campaign is not finished: where flights are missing in one part of the plan, one "
            "parameter may be taken for another."
        )
    if campaign.manifest.engine == "batched":
        said.append("These are simplified flights (engine: batched); --point flies a whole one.")
    return (*said, *found.remarks)
