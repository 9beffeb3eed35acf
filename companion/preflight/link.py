"""The way there and back: delay, losses, clocks, signatures, and who else is on it."""

import math
import statistics

from companion.preflight.facts import Identity, LinkFacts, Plan
from companion.preflight.finding import Finding, Verdict

_TRIED_S = 0.020
"""The gains have been tried with this much more delay than the vehicle's file states."""
_LOSS_WARNING, _LOSS_REFUSAL = 0.02, 0.40
"""With 30 % lost both ways a flight still goes to its end; of half nothing has been tried."""
_FEW = 50
"""Of fewer packets no loss is worth telling."""
_STEADY = 1e-3
"""A clock of real hardware is a hundred times better than this."""


def judge_link(link: LinkFacts, identity: Identity, plan: Plan) -> list[Finding]:
    """Findings on the link itself."""
    return [
        _delay(link, plan),
        _clock(link),
        _losses(link),
        _signing(link),
        *_others(identity),
    ]


def _delay(link: LinkFacts, plan: Plan) -> Finding:
    if not link.round_trips_s:
        return Finding(
            "delay",
            "TIMESYNC was never answered",
            Verdict.REFUSAL,
            "The companion needs the autopilot's clock. Check that nothing on the way filters "
            "TIMESYNC, and that the link goes both ways.",
        )
    usual_s = statistics.median(link.round_trips_s)
    shortest_s, longest_s = min(link.round_trips_s), max(link.round_trips_s)
    found = (
        f"{usual_s * 1e3:.1f} ms there and back ({shortest_s * 1e3:.1f} to {longest_s * 1e3:.1f}, "
        f"jitter {statistics.pstdev(link.round_trips_s) * 1e3:.1f} ms)"
    )
    limit_s = plan.state_age_limit_s
    if usual_s / 2.0 >= limit_s:
        return Finding(
            "delay",
            found,
            Verdict.REFUSAL,
            f"Every state would be older than {limit_s * 1e3:.0f} ms when it comes "
            "(supervisor.state_age_limit_s): no setpoint would be sent. Use a faster link.",
        )
    if longest_s / 2.0 + 1.0 / plan.state_rate_hz > limit_s:
        return Finding(
            "delay",
            found,
            Verdict.WARNING,
            f"At its slowest the state is older than {limit_s * 1e3:.0f} ms "
            "(supervisor.state_age_limit_s), and the vehicle levels out. Use a steadier link.",
        )
    if plan.loop_delay_s is not None and usual_s > plan.loop_delay_s + _TRIED_S:
        return Finding(
            "delay",
            found,
            Verdict.WARNING,
            f"The vehicle's file states {plan.loop_delay_s * 1e3:.0f} ms (dynamics.loop_delay_s), "
            f"and the gains were tried with at most {_TRIED_S * 1e3:.0f} ms more. Use a faster "
            "link, or identify and tune with this one.",
        )
    return Finding("delay", found)


def _clock(link: LinkFacts) -> Finding:
    if math.isnan(link.clock_offset_s):
        return Finding("clock", "too few answers to TIMESYNC to tell", Verdict.NOTE)
    drift = link.clock_rate - 1.0
    found = f"synchronised; it runs at {link.clock_rate:.5f} of ours"
    if abs(drift) > _STEADY:
        return Finding(
            "clock",
            found,
            Verdict.NOTE,
            "A simulation's clock: the trajectory follows it, so it flies in the autopilot's time.",
        )
    return Finding("clock", found)


def _losses(link: LinkFacts) -> Finding:
    share = link.lost / max(1, link.received + link.lost)
    found = f"{share:.1%} of {link.received + link.lost} packets lost on the way here"
    if link.received + link.lost >= _FEW and share > _LOSS_REFUSAL:
        return Finding("loss", found, Verdict.REFUSAL, "Mend the link: this is too much to fly on.")
    if link.received + link.lost >= _FEW and share > _LOSS_WARNING:
        return Finding(
            "loss",
            found,
            Verdict.WARNING,
            "Shorten the radio's way, lower the streams' rates or raise the link's.",
        )
    return Finding("loss", found)


def _signing(link: LinkFacts) -> Finding:
    if link.we_sign:
        if link.rejected:
            return Finding(
                "signing",
                f"on; {link.rejected} packets were not taken",
                Verdict.WARNING,
                "Somebody on this link has no key, another one, or sends old packets again.",
            )
        return Finding("signing", "on")
    if link.vehicle_signs:
        return Finding(
            "signing",
            "the vehicle signs its packets, and the companion has no key",
            Verdict.REFUSAL,
            "It will obey nothing. Give the key (link.signing, or COMPANION_SIGNING_KEY).",
        )
    if link.local:
        return Finding("signing", "off; the link does not leave this computer")
    return Finding(
        "signing",
        "off: whoever reaches this link can command the vehicle",
        Verdict.NOTE,
        "Set a key on both sides where others share the network (link.signing).",
    )


def _others(identity: Identity) -> list[Finding]:
    findings = []
    if identity.other_vehicles:
        findings.append(
            Finding(
                "other vehicles",
                ", ".join(identity.other_vehicles),
                Verdict.WARNING,
                f"The companion speaks to system {identity.system_id} alone. If another one is "
                "meant, give it a link of its own or name it by link.system_id.",
            )
        )
    if identity.other_senders:
        findings.append(
            Finding(
                "others on the link", ", ".join(identity.other_senders), Verdict.NOTE,
            )
        )  # fmt: skip
    return findings
