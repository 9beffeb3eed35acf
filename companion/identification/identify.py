"""From a recording to a vehicle's figures: each fit in its turn."""

from dataclasses import dataclass

from companion.identification.attitude_fit import fit_tilt
from companion.identification.climb_fit import climb_by_lift, fit_climb
from companion.identification.estimates import Identified
from companion.identification.lift_fit import fit_lift, fit_reported_lift
from companion.identification.link_fit import fit_loop_delay
from companion.identification.noise_fit import fit_noise
from companion.identification.push_fit import fit_push
from companion.identification.recording import Recording
from companion.identification.scatter import FittedScatter
from companion.identification.vertical_scatter import vertical_scatter


@dataclass(frozen=True, slots=True)
class Weighting:
    """The scatter that the fits of velocities are weighted with."""

    horizontal: tuple[FittedScatter, FittedScatter]
    """Along x and y."""
    vertical: FittedScatter


def identify(recording: Recording, *, thrust_curve: float = 0.0) -> Identified:
    """Everything that an identification flight tells.

    Args:
        recording: of the flight.
        thrust_curve: c in force = c t² + (1 - c) t of the thrust field, as the vehicle's file has
            it.

    Raises:
        UnidentifiedError: something can't be told from it; the text says what to do.
    """
    return identify_weighted(recording, thrust_curve=thrust_curve)[0]


def identify_weighted(
    recording: Recording, *, thrust_curve: float = 0.0, weighting: Weighting | None = None
) -> tuple[Identified, Weighting]:
    """The same, with the weighting of another recording, or saying its own.

    What a model that is not quite right comes to depends on how its misfit is weighted; who asks
    what the very same fit makes of a noiseless flight takes the noisy one's weighting for it.

    Args:
        recording: of the flight.
        thrust_curve: see `identify`.
        weighting: of another recording; None: this one's own, estimated from its residuals.

    Raises:
        UnidentifiedError: something can't be told from it; the text says what to do.
    """
    roll, pitch = fit_tilt(recording, "roll"), fit_tilt(recording, "pitch")
    push = fit_push(recording, None if weighting is None else weighting.horizontal)
    vertical = None if weighting is None else weighting.vertical
    delay, jitter = fit_loop_delay(recording)
    if recording.thrust_meaning.kind == "climb_rate":
        flown = fit_climb(recording)
        lift, climb, curve = None, flown.response, flown.curve
        reported = fit_reported_lift(recording, vertical)
        hover = None if reported is None else reported.hover_thrust
        scatter = vertical_scatter(recording) if reported is None else reported.scatter
    else:
        lifted = fit_lift(recording, thrust_curve, vertical)
        lift, climb, curve = lifted.response, climb_by_lift(lifted), lifted.curve
        hover, scatter = lifted.hover_thrust, lifted.scatter
    identified = Identified(
        roll=roll.response,
        pitch=pitch.response,
        tilt_gain=push.tilt_gain,
        lift=lift,
        climb=climb,
        linear_drag_1_s=push.linear_drag_1_s,
        quadratic_drag_1_m=push.quadratic_drag_1_m,
        hover_thrust=hover,
        loop_delay_s=delay,
        loop_delay_jitter_s=jitter,
        noise_estimates=fit_noise(
            recording, (*push.scatters, scatter), (roll.scatter, pitch.scatter)
        ),
        trim_roll_rad=push.trim_roll_rad,
        trim_pitch_rad=push.trim_pitch_rad,
        curves=(roll.curve, pitch.curve, curve, *push.curves),
    )
    return identified, Weighting(push.scatters, scatter)
