"""What a check says: one finding for each thing looked at."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import StrEnum


class Verdict(StrEnum):
    """How a finding weighs; each is worse than the one before."""

    OK = "ok"
    NOTE = "note"
    """Worth knowing; a flight says nothing of it."""
    WARNING = "warning"
    """The flight goes on, and says it."""
    REFUSAL = "refusal"
    """No flight like this."""

    @property
    def weight(self) -> int:
        """0 for the best."""
        return list(Verdict).index(self)


@dataclass(frozen=True, slots=True)
class ParameterChange:
    """A parameter of the autopilot that would be better otherwise."""

    name: str
    old: float
    new: float
    why: str
    """What the new value brings about, in a clause."""

    def __str__(self) -> str:
        return f"{self.name} {self.old:g} → {self.new:g}: {self.why}"


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that was looked at."""

    subject: str
    """What, in a word or by its parameter's name; it begins a sentence or a row."""
    found: str
    """What it is, with its figure and what that means."""
    verdict: Verdict = Verdict.OK
    advice: str = ""
    """What to do about it; empty when there is nothing to do."""
    change: ParameterChange | None = None
    """The parameter that would mend it, if one would."""

    @property
    def sentence(self) -> str:
        """For a person, in one line."""
        found = f"{self.subject}: {self.found}"
        return f"{found}. {self.advice}" if self.advice else found


def worst(findings: Iterable[Finding]) -> Verdict:
    """The worst verdict; OK of none."""
    return max((f.verdict for f in findings), key=lambda v: v.weight, default=Verdict.OK)


def with_verdict(findings: Iterable[Finding], *verdicts: Verdict) -> list[Finding]:
    """The findings of these verdicts, in their order."""
    return [finding for finding in findings if finding.verdict in verdicts]


def accepting(findings: Iterable[Finding], subjects: Iterable[str]) -> list[Finding]:
    """The findings, with those refusals that a person accepts made warnings.

    Args:
        findings: all of them.
        subjects: what is accepted.
    """
    accepted = frozenset(subjects)
    return [
        replace(f, verdict=Verdict.WARNING)
        if f.verdict is Verdict.REFUSAL and f.subject in accepted
        else f
        for f in findings
    ]


def changes_of(findings: Iterable[Finding]) -> list[ParameterChange]:
    """The parameters to set, in the order in which they are to be set; each once."""
    changes = {f.change.name: f.change for f in findings if f.change is not None}
    return list(changes.values())
