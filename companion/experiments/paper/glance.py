"""The summary box of the study's page: how many of the paper's claims were reproduced."""

import math
from collections.abc import Sequence

from companion.experiments.paper.headline import MeanError, verdict_counts
from companion.experiments.paper.results import Claim, PaperResults
from companion.experiments.paper.statistics import millimetres
from companion.report.pages.glance import Glance, KeyFigure, Level


def study_glance(
    results: PaperResults, claims: Sequence[Claim], errors: Sequence[MeanError]
) -> Glance:
    """The box.

    Args:
        results: of the study.
        claims: judged.
        errors: mean errors, MPC-L1's first.
    """
    counts = verdict_counts(claims)
    reproduced, own = counts["reproduced"], errors[0]
    rest = [f"{count} {name}" for name, count in counts.items() if name != "reproduced" and count]
    verb = "was" if reproduced == 1 else "were"
    sentence = f"{reproduced} of the paper's {len(claims)} claims {verb} reproduced"
    sentence += f" ({', '.join(rest)})" if rest else ""
    if math.isfinite(own.calm.mean):
        sentence += f"; MPC-L1 tracks to {millimetres(own.calm, ' mm')} in calm air"
        if math.isfinite(own.fan.mean):
            sentence += f", {millimetres(own.fan, ' mm')} with the fan"
    else:
        sentence += "; MPC-L1 did not fly all trajectories to their end"
    not_so = [
        f"Not reproduced: “{claim.quote}” (§ {claim.section})"
        for claim in claims
        if claim.verdict == "not reproduced"
    ]
    lost = results.provenance.lost
    figures = (
        KeyFigure("claims reproduced", f"{reproduced} of {len(claims)}"),
        KeyFigure("MPC-L1, calm", millimetres(own.calm), "mm"),
        KeyFigure("MPC-L1, fan", millimetres(own.fan), "mm"),
        KeyFigure("flights", f"{results.provenance.flights}"),
        KeyFigure("lost", f"{lost}", "", "half" if lost else None),
    )
    level: Level = "bad" if not reproduced else "half" if rest else "good"
    return Glance(level, f"{sentence}.", figures, tuple(not_so))
