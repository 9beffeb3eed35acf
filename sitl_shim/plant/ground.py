"""Contact with level ground: inelastic impulses with Coulomb friction at the vehicle's points.

Impulses act on velocities after a free step, so nothing is stiff: a fall of any height ends in
one step, and a vehicle at rest neither sinks nor trembles.  Solved point by point with
accumulated impulses (sequential impulses; E. Catto, "Iterative Dynamics with Temporal
Coherence", 2005).
"""

from math import hypot, sqrt

from sitl_shim.frames import Vector3, rotate, rotation_matrix
from sitl_shim.plant.rigid_body import Motion
from sitl_shim.plant.vehicle import GRAVITY_M_S2, VehicleModel

_SWEEPS = 40
_SETTLED_M_S = 1e-4
_REST_SPEED_M_S = 0.03
_REST_RATE_RAD_S = 0.1
_REST_GAP_M = 0.001


class Ground:
    """Level ground under a vehicle that stands on it with its centre of mass at z = 0."""

    __slots__ = (
        "_feet",
        "_foot_radius_m",
        "_foot_x_m",
        "_foot_y_m",
        "_friction",
        "_inertia",
        "_mass_kg",
        "_points",
        "_reach_m",
        "_weight_n",
        "height_enu_m",
    )

    def __init__(self, vehicle: VehicleModel) -> None:
        gear = vehicle.ground_contact
        x, y, z = gear.foot_x_m, gear.foot_y_m, gear.foot_depth_m
        self._feet: tuple[Vector3, ...] = ((x, y, -z), (x, -y, -z), (-x, y, -z), (-x, -y, -z))
        # The rotors touch the ground when the vehicle lies on its side or on its back.
        self._points = self._feet + tuple(rotor.position_flu_m for rotor in vehicle.rotors)
        self._reach_m = max(hypot(*point) for point in self._points)
        self._foot_x_m, self._foot_y_m, self._foot_radius_m = x, y, hypot(x, y)
        self._mass_kg = vehicle.mass_kg
        self._weight_n = vehicle.mass_kg * GRAVITY_M_S2
        self._inertia = vehicle.inertia_kg_m2
        self._friction = gear.friction
        self.height_enu_m = -z

    def near(self, height_enu_m: float) -> bool:
        """Whether any attitude could make a point touch, at this z of the centre of mass."""
        return height_enu_m - self.height_enu_m < self._reach_m

    def resolve(self, height_enu_m: float, motion: Motion) -> tuple[float, Motion] | None:
        """Push the vehicle out of the ground and stop what moves into it.

        Args:
            height_enu_m: z of the centre of mass, after a free step.
            motion: after a free step.

        Returns:
            How far to lift the vehicle (m) and its motion; None if nothing touches.
        """
        vx, vy, vz, qw, qx, qy, qz, p, q, r = motion
        rows = rotation_matrix((qw, qx, qy, qz))
        (m00, m01, m02), (m10, m11, m12), up = rows
        nx, ny, nz = up
        clearance = height_enu_m - self.height_enu_m
        inverse_mass = 1.0 / self._mass_kg
        ix, iy, iz = self._inertia
        lift = 0.0
        contacts: list[list[float]] = []
        for a, b, c in self._points:
            depth = -(clearance + nx * a + ny * b + nz * c)
            if depth < 0.0:
                continue
            lift = max(lift, depth)
            # angular answer to a unit impulse along the normal, and the mass that it meets
            gx, gy, gz = (b * nz - c * ny) / ix, (c * nx - a * nz) / iy, (a * ny - b * nx) / iz
            answer = inverse_mass + (
                (gy * c - gz * b) * nx + (gz * a - gx * c) * ny + (gx * b - gy * a) * nz
            )
            contacts.append([a, b, c, gx, gy, gz, answer, 0.0, 0.0, 0.0, 0.0])
        if not contacts:
            return None
        # everything in the body frame from here on
        bx = m00 * vx + m10 * vy + nx * vz
        by = m01 * vx + m11 * vy + ny * vz
        bz = m02 * vx + m12 * vy + nz * vz
        for _ in range(_SWEEPS):
            largest = 0.0
            for contact in contacts:
                a, b, c, gx, gy, gz, answer, normal, fx, fy, fz = contact
                sx, sy, sz = bx + q * c - r * b, by + r * a - p * c, bz + p * b - q * a
                sinking = sx * nx + sy * ny + sz * nz
                wanted = max(0.0, normal - sinking / answer)
                change = wanted - normal
                largest = max(largest, abs(change))
                contact[7] = wanted
                bx += change * inverse_mass * nx
                by += change * inverse_mass * ny
                bz += change * inverse_mass * nz
                p += change * gx
                q += change * gy
                r += change * gz
                # friction against the sliding that is left
                sx, sy, sz = bx + q * c - r * b, by + r * a - p * c, bz + p * b - q * a
                sinking = sx * nx + sy * ny + sz * nz
                sx, sy, sz = sx - sinking * nx, sy - sinking * ny, sz - sinking * nz
                speed = sqrt(sx * sx + sy * sy + sz * sz)
                if speed < 1e-9:
                    continue
                tx, ty, tz = sx / speed, sy / speed, sz / speed
                hx, hy, hz = (b * tz - c * ty) / ix, (c * tx - a * tz) / iy, (a * ty - b * tx) / iz
                grip = speed / (
                    inverse_mass
                    + ((hy * c - hz * b) * tx + (hz * a - hx * c) * ty + (hx * b - hy * a) * tz)
                )
                ex, ey, ez = fx - grip * tx, fy - grip * ty, fz - grip * tz
                size, most = sqrt(ex * ex + ey * ey + ez * ez), self._friction * wanted
                if size > most:
                    ex, ey, ez = ex * most / size, ey * most / size, ez * most / size
                contact[8:11] = ex, ey, ez
                jx, jy, jz = ex - fx, ey - fy, ez - fz
                bx += jx * inverse_mass
                by += jy * inverse_mass
                bz += jz * inverse_mass
                p += (b * jz - c * jy) / ix
                q += (c * jx - a * jz) / iy
                r += (a * jy - b * jx) / iz
            if largest * inverse_mass < _SETTLED_M_S:
                break
        vx, vy, vz = rotate((qw, qx, qy, qz), (bx, by, bz))
        return lift, (vx, vy, vz, qw, qx, qy, qz, p, q, r)

    def stands(self, height_enu_m: float, motion: Motion) -> bool:
        """Whether the vehicle is on all four feet and as good as still."""
        vx, vy, vz, w, x, y, z, p, q, r = motion
        if hypot(vx, vy, vz) > _REST_SPEED_M_S or hypot(p, q, r) > _REST_RATE_RAD_S:
            return False
        nx, ny, nz = rotation_matrix((w, x, y, z))[2]
        clearance = height_enu_m - self.height_enu_m
        return all(clearance + nx * a + ny * b + nz * c < _REST_GAP_M for a, b, c in self._feet)

    def holds(self, pull: Motion) -> bool:
        """Whether ground and friction cancel what a vehicle at rest would do without them.

        Args:
            pull: derivative of the motion at rest, in free air.
        """
        ax, ay, az = pull[0], pull[1], pull[2]
        ix, iy, iz = self._inertia
        torque_x, torque_y, torque_z = ix * pull[7], iy * pull[8], iz * pull[9]
        load_n = -az * self._mass_kg
        side_n = hypot(ax, ay) * self._mass_kg
        # A side force at the height of the centre of mass tips the vehicle over its feet.
        tip_n_m = -side_n * self.height_enu_m
        return (
            load_n > 0.0
            and side_n + abs(torque_z) / self._foot_radius_m <= self._friction * load_n
            and abs(torque_x) + tip_n_m <= load_n * self._foot_y_m
            and abs(torque_y) + tip_n_m <= load_n * self._foot_x_m
        )
