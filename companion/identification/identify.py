"""From a recording to a vehicle's figures: each fit in its turn."""

from companion.identification.attitude_fit import fit_tilt
from companion.identification.climb_fit import climb_by_lift, fit_climb
from companion.identification.estimates import Identified
from companion.identification.lift_fit import fit_lift
from companion.identification.link_fit import fit_loop_delay, fit_reported_hover_thrust
from companion.identification.noise_fit import fit_noise
from companion.identification.push_fit import fit_push
from companion.identification.recording import Recording
from companion.identification.vertical_scatter import vertical_scatter


def identify(recording: Recording, *, thrust_curve: float = 0.0) -> Identified:
    """Everything that an identification flight tells.

    Args:
        recording: of the flight.
        thrust_curve: c in force = c t² + (1 - c) t of the thrust field, as the vehicle's file has
            it.

    Raises:
        UnidentifiedError: something can't be told from it; the text says what to do.
    """
    roll, pitch = fit_tilt(recording, "roll"), fit_tilt(recording, "pitch")
    push = fit_push(recording)
    delay, jitter = fit_loop_delay(recording)
    if recording.thrust_meaning.kind == "climb_rate":
        flown = fit_climb(recording)
        lift, climb, curve = None, flown.response, flown.curve
        hover = fit_reported_hover_thrust(recording)
        vertical = vertical_scatter(recording)
    else:
        lifted = fit_lift(recording, thrust_curve)
        lift, climb, curve = lifted.response, climb_by_lift(lifted), lifted.curve
        hover, vertical = lifted.hover_thrust, lifted.scatter
    return Identified(
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
            recording, (*push.scatters, vertical), (roll.scatter, pitch.scatter)
        ),
        trim_roll_rad=push.trim_roll_rad,
        trim_pitch_rad=push.trim_pitch_rad,
        curves=(roll.curve, pitch.curve, curve, *push.curves),
    )
