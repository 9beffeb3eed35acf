"""The scatter of the climb rate where the autopilot flies it and no thrust is known."""

import numpy as np

from companion.identification.parts import require, stretches, thinned
from companion.identification.recording import Recording
from companion.identification.scatter import FittedScatter, Residual, VelocityScatter, likeliest
from companion.identification.signals import since_begin_s

_THINNED = 400


def vertical_scatter(recording: Recording) -> FittedScatter:
    """Of the climb rate in the hover, as the loop leaves it.

    Raises:
        UnidentifiedError: there is no hover.
    """
    require(recording, "hover")
    times = since_begin_s(recording)
    climb = recording.velocity_enu_m_s[:, 2]
    return likeliest(
        VelocityScatter,
        [
            Residual(times[rows], climb[rows], np.ones((len(rows), 1)))
            for rows in thinned(stretches(recording, "hover"), _THINNED)
        ],
    )
