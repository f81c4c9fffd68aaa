"""Solves for the fastest lap by CasADi and IPOPT: lap_peer.py CAR.toml TRACK.csv LAP.csv [--nodes N] [--margin M] [--transients]"""

import argparse
import json
import sys
import time
import tomllib
from dataclasses import dataclass
from pathlib import Path

import casadi as ca
import numpy as np
from scipy.interpolate import BSpline, CubicSpline, make_interp_spline
from scipy.optimize import minimize_scalar

# Acceleration of gravity [m/s²].
G = 9.81
# What steering and pedals at their fastest cost, as a share of the time.
SMOOTHNESS = 3e-2
# Share of the weight within which a driving force turns into a braking one.
SPLIT_WIDTH = 0.005
# Slowest speed of a lap [m/s].
SLOWEST = 2.0
# What has to be left of the radius of a bend at the inner edge [-].
LEAST_RADIUS_SHARE = 0.1
# Bounds of what never reaches them: angle to the line [rad], velocity to the left [m/s], yaw rate [rad/s].
MOST_XI, MOST_V_Y, MOST_R, MOST_A_Y = 1.2, 30.0, 6.0, 100.0
# The same of a body that swings: heave [m], roll and pitch [rad].
MOST_HEAVE, MOST_ANGLE, MOST_BODY_RATE = 0.5, 0.3, 10.0
# Length of the slip vector [-] at which its root is rounded: it has no derivative at 0.
LEAST_SLIP = 1e-6
# The peak of a tire is looked for at these slips [rad, -].
PEAK_SLIPS = np.arange(1, 501) * 1e-3
# How far an open lap may begin from straight ahead [rad, m/s, rad/s].
START_TOLERANCE = 1e-3
# Share of the grip that the start of the search uses, across and along.
START_GRIP = 0.5

# Unknowns of a node with their sizes; None is one of the car.
STATES = {"n": 5.0, "xi": 0.3, "v_x": 30.0, "v_y": 3.0, "r": 1.0, "delta": 0.1, "F_x": None}
BODY_STATES = {"z": 0.02, "phi": 0.05, "theta": 0.02, "z_rate": 0.2, "phi_rate": 0.3, "theta_rate": 0.2}
SLIPS = {"kappa_fl": 0.1, "kappa_fr": 0.1, "kappa_rl": 0.1, "kappa_rr": 0.1}
CONTROLS = {"delta_rate": None, "F_x_rate": None, **SLIPS, "a_y": 10.0}

# Both are called with a place and the order of a derivative.
Spline = BSpline | CubicSpline


@dataclass
class Body:
    """A rigid body [kg, kg m², m]; without track widths no load moves across."""

    m: float
    I_zz: float
    l_f: float
    l_r: float
    h: float
    track_f: float = 0.0
    track_r: float = 0.0
    I_xx: float = np.nan
    I_yy: float = np.nan


@dataclass
class Roll:
    """Roll stiffness [N m/rad], damping [N m s/rad] and roll centres [m] of the axles."""

    stiffness_f: float = 0.0
    stiffness_r: float = 0.0
    damping_f: float = np.nan
    damping_r: float = np.nan
    centre_f: float = 0.0
    centre_r: float = 0.0


@dataclass
class Ride:
    """Stiffness [N/m] and damping [N s/m] of each wheel in heave."""

    stiffness_f: float = np.inf
    stiffness_r: float = np.inf
    damping_f: float = np.nan
    damping_r: float = np.nan


@dataclass
class Pitch:
    """Height of the pitch centre [m]."""

    centre: float = 0.0


@dataclass
class Aero:
    """Air density [kg/m³], frontal area [m²] and coefficients [-]; a map of them over the ride heights [m]."""

    area: float
    C_d: float
    C_lf: float
    C_lr: float
    rho: float = 1.225
    ride_height_f: float = 0.0
    ride_height_r: float = 0.0
    map: str = ""

    def force_per_coefficient(self, v_x):
        return 0.5 * self.rho * self.area * v_x * v_x

    def planes(self):
        """Of each coefficient the value at height 0 and the slopes over both heights: the map has to consist of planes."""
        rows = np.array([[float(it) for it in row.split(",")] for row in self.map.strip().splitlines()[1:]])
        ones = np.ones((len(rows), 1))
        planes, *_ = np.linalg.lstsq(np.hstack([ones, rows[:, :2]]), rows[:, 2:], rcond=None)
        if np.max(np.abs(np.hstack([ones, rows[:, :2]]) @ planes - rows[:, 2:])) > 1e-12:
            raise ValueError("expected an aero map of planes")
        return planes[0], planes[1:].T


@dataclass
class Axles:
    """Part of a force that acts at the front [-]."""

    front_share: float


@dataclass
class Tire:
    """The Magic Formula of a tire without shifts, proportional to the load."""

    B: float
    C: float
    D: float
    E: float
    S_h: float = 0.0
    S_v: float = 0.0

    def __post_init__(self):
        if self.S_h != 0.0 or self.S_v != 0.0:
            raise ValueError("expected a tire without shifts")

    def mu(self, slip):
        Bx = self.B * slip
        return self.D * ca.sin(self.C * ca.atan(Bx - self.E * (Bx - ca.atan(Bx))))

    def forces(self, kappa, alpha, F_z):
        """Longitudinal and lateral force: the curve at the length of the slip vector, against it."""
        length = ca.sqrt(kappa * kappa + alpha * alpha + LEAST_SLIP**2)
        secant = ca.fmax(F_z, 0.0) * self.mu(length) / length
        return secant * kappa, -secant * alpha

    def peak(self):
        best = PEAK_SLIPS[np.argmax(self.mu(ca.DM(PEAK_SLIPS)).full())]
        near = (best - PEAK_SLIPS[0], min(best + PEAK_SLIPS[0], PEAK_SLIPS[-1]))
        return minimize_scalar(lambda slip: -float(self.mu(slip)), bounds=near, method="bounded", options={"xatol": 1e-12}).x


@dataclass
class Limits:
    """Bounds of steering angle [rad], its rate [rad/s], force [N], its rate [N/s] and power [W]."""

    delta: float
    delta_rate: float
    F_x_rate: float
    F_x_min: float
    F_x_max: float
    power: float


@dataclass
class Car:
    """A body on four tires, air, actuators."""

    body: Body
    roll: Roll
    ride: Ride
    pitch: Pitch
    aero: Aero
    brake: Axles
    drive: Axles
    tire_f: Tire
    tire_r: Tire
    limit: Limits
    transients: bool = False

    @staticmethod
    def from_toml(path: Path, transients: bool) -> "Car":
        kinds = {name: kind for name, kind in Car.__annotations__.items() if name != "transients"}
        tables = {"roll": {}, "ride": {}, "pitch": {}} | tomllib.loads(path.read_text())
        # Plants know the power of the drive by this name.
        if "power_max" in tables.get("drive", {}):
            tables["limit"]["power"] = tables["drive"].pop("power_max")
        if set(tables) != set(kinds):
            raise ValueError(f"expected the tables {sorted(kinds)}, found {sorted(tables)}")
        return Car(**{name: kinds[name](**table) for name, table in tables.items()}, transients=transients)

    def states(self):
        return list(STATES) + list(BODY_STATES if self.transients else {})

    def variables(self):
        return self.states() + list(CONTROLS)

    def sizes(self):
        own = {"F_x": self.body.m * G, "delta_rate": self.limit.delta_rate, "F_x_rate": self.limit.F_x_rate}
        return np.array([own.get(name) or (STATES | BODY_STATES | CONTROLS)[name] for name in self.variables()])

    def static_loads(self):
        body = self.body
        weight = body.m * G / (body.l_f + body.l_r)
        return weight * body.l_r, weight * body.l_f

    def load_transfer_gains(self):
        """Load that moves from one wheel of each axle to the other [N] over a lateral acceleration [m/s²]."""
        body, roll = self.body, self.roll
        stiffness = roll.stiffness_f + roll.stiffness_r
        front = roll.stiffness_f / stiffness if stiffness > 0.0 else body.l_r / (body.l_f + body.l_r)
        sides = (front, body.track_f), (1.0 - front, body.track_r)
        return [share * body.m * body.h / width if width > 0.0 else 0.0 for share, width in sides]

    def split_force(self, F_x):
        """What is asked of the front and the rear axle [N]: driving and braking forces act at other shares."""
        root = ca.sqrt(F_x**2 + (SPLIT_WIDTH * self.body.m * G) ** 2)
        driving, braking = (F_x + root) / 2.0, (F_x - root) / 2.0
        front = self.drive.front_share * driving + self.brake.front_share * braking
        return front, F_x - front

    def drag_and_downforce(self, v_x, F_x, unknowns: dict):
        """Drag and the downforce of both axles [N]; with a map at the ride heights of the body, or at which the springs carry the load."""
        aero, force = self.aero, self.aero.force_per_coefficient(v_x)
        if not aero.map:
            return force * aero.C_d, force * aero.C_lf, force * aero.C_lr
        base, slopes = aero.planes()
        if self.transients:
            z, theta = unknowns["z"], unknowns["theta"]
            heights = ca.vertcat(aero.ride_height_f + z - self.body.l_f * theta, aero.ride_height_r + z + self.body.l_r * theta)
            return tuple(ca.vertsplit(force * (ca.DM(base) + ca.mtimes(ca.DM(slopes), heights))))
        lever = self.body.h / (self.body.l_f + self.body.l_r)
        # Loads of the axles over the three coefficients: drag pitches the car back less than F_x does.
        carried = ca.DM([[lever, 1.0, 0.0], [-lever, 0.0, 1.0]])
        compliance = ca.diag(ca.DM([0.5 / self.ride.stiffness_f, 0.5 / self.ride.stiffness_r]))
        rest = ca.DM([aero.ride_height_f, aero.ride_height_r])
        moved = ca.vertcat(-F_x, F_x) * lever
        matrix = ca.DM.eye(2) + force * ca.mtimes([compliance, carried, ca.DM(slopes)])
        heights = ca.solve(matrix, rest - ca.mtimes(compliance, force * ca.mtimes(carried, ca.DM(base)) + moved))
        drag, front, rear = ca.vertsplit(force * (ca.DM(base) + ca.mtimes(ca.DM(slopes), heights)))
        return drag, front, rear

    def body_on_springs(self, body: dict, drag, downforce, F_x, a_y):
        """Mean load of the wheels of each axle and what moves across [N], and the accelerations of heave, roll and pitch."""
        b, ride, roll, h_pc = self.body, self.ride, self.roll, self.pitch.centre
        L, push = b.l_f + b.l_r, F_x - drag
        axles = [
            (b.l_f, b.l_r / L, ride.stiffness_f, ride.damping_f, roll.stiffness_f, roll.damping_f, roll.centre_f, b.track_f),
            (-b.l_r, b.l_f / L, ride.stiffness_r, ride.damping_r, roll.stiffness_r, roll.damping_r, roll.centre_r, b.track_r),
        ]
        means, acrosses = [], []
        for x, share, k, c, K, C, h_rc, track in axles:
            spring = k * (x * body["theta"] - body["z"]) + c * (x * body["theta_rate"] - body["z_rate"])
            link = -np.sign(x) * h_pc * push / L / 2.0
            mean = b.m * G * share / 2.0 + spring + link
            means.append(mean)
            moment = K * body["phi"] + C * body["phi_rate"] + h_rc * b.m * a_y * share
            acrosses.append(without_lifting(moment / track, mean))
        h_ra = (b.l_r * roll.centre_f + b.l_f * roll.centre_r) / L
        lift = 2.0 * (means[0] + means[1]) - b.m * G - downforce[0] - downforce[1]
        rolling = b.h * b.m * a_y + b.m * G * (b.h - h_ra) * body["phi"] - acrosses[0] * b.track_f - acrosses[1] * b.track_r
        on_axles = [2.0 * mean - down for mean, down in zip(means, downforce)]
        pitching = -b.h * push - b.l_f * on_axles[0] + b.l_r * on_axles[1] + b.m * G * (b.h - h_pc) * body["theta"]
        return means, acrosses, [lift / b.m, rolling / b.I_xx, pitching / b.I_yy]

    def top_speed(self):
        drag = 0.5 * self.aero.rho * self.aero.area * self.aero.C_d
        return float(np.clip(1.2 * np.cbrt(self.limit.power / drag) if drag > 0.0 else np.inf, 10.0 * SLOWEST, 150.0))


@dataclass
class Track:
    """A line in the plane as a spline over its length, with the ways from it to both edges at its knots."""

    closed: bool
    length: float
    spline: Spline
    stations: np.ndarray
    left: np.ndarray
    right: np.ndarray

    @staticmethod
    def from_csv(path: Path) -> "Track":
        names, rows, words = [], [], []
        for line in path.read_text().splitlines():
            if line.startswith("#"):
                words.append(line[1:].strip().lower())
            elif not names:
                names = [it.strip() for it in line.split(",")]
            elif line.strip():
                rows.append([float(it) for it in line.split(",")])
        if names != ["x_m", "y_m", "left_m", "right_m"]:
            raise ValueError(f"expected the columns x_m, y_m, left_m and right_m, found {names}")
        table = np.array(rows)
        gap = np.linalg.norm(table[-1, :2] - table[0, :2])
        ways = np.sort(np.linalg.norm(np.diff(table[:, :2], axis=0), axis=1))
        closed = "closed" in words or ("open" not in words and gap <= 2.0 * ways[len(ways) // 2])
        if closed and gap >= 1e-3:
            table = np.vstack([table, table[0]])
        elif closed:
            table[-1] = table[0]
        return Track.from_table(table, closed)

    @staticmethod
    def from_table(table: np.ndarray, closed: bool) -> "Track":
        """A first spline over chords gives the length, a second one through equidistant points of it is over length."""
        points = table[:, :2]
        chords = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
        spline = cubic_spline(chords, points, closed)
        arcs = np.concatenate([[0.0], np.cumsum(arc_length(spline, chords[:-1], chords[1:]))])
        length = arcs[-1]
        # A knot every metre.
        stations = np.linspace(0.0, length, int(np.ceil(np.clip(length, 200.0, 2e6))) + 1)
        segment = np.clip(np.searchsorted(arcs, stations) - 1, 0, len(chords) - 2)
        chord = np.interp(stations, arcs, chords)
        for _ in range(20):
            missing = stations - arcs[segment] - arc_length(spline, chords[segment], chord)
            chord += missing / np.linalg.norm(spline(chord, 1), axis=-1)
        knots = spline(chord)
        if closed:
            knots[-1] = knots[0]
        left, right = (np.interp(stations, arcs, table[:, column]) for column in (2, 3))
        return Track(closed, length, cubic_spline(stations, knots, closed), stations, left, right)

    def curvature(self, s):
        (dx, dy), (ddx, ddy) = self.spline(s, 1).T, self.spline(s, 2).T
        return (dx * ddy - dy * ddx) / np.hypot(dx, dy) ** 3

    def node_stations(self, nodes: int):
        return np.linspace(0.0, self.length, nodes, endpoint=not self.closed)

    def node_ways(self, nodes: int):
        """The way along the line that each node stands for [m]: half a step at an end."""
        step = self.length / (nodes if self.closed else nodes - 1)
        ways = np.full(nodes, step)
        if not self.closed:
            ways[[0, -1]] *= 0.5
        return ways

    def deviation_bounds(self, s, margin: float):
        """Least and largest lateral deviation [m]; the line's own normals must not cross on the road."""
        kappa = self.curvature(s)
        left, right = (np.interp(s, self.stations, width) - margin for width in (self.left, self.right))
        most = (1.0 - LEAST_RADIUS_SHARE) / np.maximum(np.abs(kappa), 1e-9)
        lower = np.where(kappa > 0.0, -right, -np.minimum(right, most))
        upper = np.where(kappa > 0.0, np.minimum(left, most), left)
        if np.any(upper - lower < 0.02):
            raise ValueError("expected a road that is wider than the car and its bends")
        return lower, upper


def cubic_spline(x, y, closed: bool) -> Spline:
    if closed:
        return CubicSpline(x, y, bc_type="periodic")
    # Parabolic ends: a line that starts in a bend keeps its curvature.
    ends = [(3, np.zeros(y.shape[1]))]
    return make_interp_spline(x, y, k=3, bc_type=(ends, ends))


def arc_length(spline: Spline, begin, end):
    """Length of the arcs between two chord lengths of one segment [m], by the Gauss-Legendre rule of five points."""
    nodes, weights = np.polynomial.legendre.leggauss(5)
    half = 0.5 * (end - begin)
    speeds = [np.linalg.norm(spline(begin + half * (1.0 + node), 1), axis=-1) for node in nodes]
    return half * np.dot(weights, speeds)


@dataclass
class Lap:
    """What is compared of a lap: stations, the motion at them, and its time."""

    s: np.ndarray
    n: np.ndarray
    time: float

    @staticmethod
    def from_csv(path: Path, track: Track) -> "Lap":
        lines = [it for it in path.read_text().splitlines() if it.strip() and not it.startswith("#")]
        names = [it.split("[")[0].strip().strip('"') for it in lines[0].split(",")]
        columns = np.array([[float(it) for it in line.split(",")] for line in lines[1:]]).T
        column = dict(zip(names, columns, strict=True))
        s = track.node_stations(len(columns[0]))
        error = np.max(np.abs(column["s"] - s))
        if error > 1e-2:
            raise ValueError(f"expected {len(s)} equal steps on {track.length:.3f} m, found one {error:.3f} m off")
        time = lap_time(track, column["n"], column["xi"], column["v_x"], column["v_y"])
        return Lap(s, column["n"], time)


def without_lifting(across, mean):
    """The load that moves across: no wheel has less than none."""
    return across / (1.0 + (across / mean) ** 8) ** 0.125


def slowness(n, xi, v_x, v_y, kappa):
    """Time over way along the line [s/m]."""
    return (1.0 - n * kappa) / (v_x * ca.cos(xi) - v_y * ca.sin(xi))


def lap_time(track: Track, n, xi, v_x, v_y):
    kappa = track.curvature(track.node_stations(len(n)))
    columns = [ca.DM(it) for it in (n, xi, v_x, v_y, kappa)]
    return float(ca.dot(track.node_ways(len(n)), slowness(*columns)))


def node_function(car: Car) -> ca.Function:
    """Of scaled unknowns and the curvature of the line: slowness, price, scaled slopes, equations, inequalities."""
    scale = car.sizes()
    x, curvature = ca.SX.sym("x", len(scale)), ca.SX.sym("kappa")
    unknowns = dict(zip(car.variables(), ca.vertsplit(x * scale), strict=True))
    n, xi, v_x, v_y, r, delta, F_x = (unknowns[name] for name in STATES)
    delta_rate, F_x_rate, *kappas, a_y = (unknowns[name] for name in CONTROLS)
    body, limit = car.body, car.limit
    L, weight = body.l_f + body.l_r, body.m * G

    drag, down_f, down_r = car.drag_and_downforce(v_x, F_x, unknowns)
    body_rates, sideways = [], [0.0, 0.0]
    if car.transients:
        means, acrosses, accelerations = car.body_on_springs(unknowns, drag, [down_f, down_r], F_x, a_y)
        body_rates = [unknowns["z_rate"], unknowns["phi_rate"], unknowns["theta_rate"], *accelerations]
        sideways = [unknowns["phi_rate"] * (body.h - centre) for centre in (car.roll.centre_f, car.roll.centre_r)]
    else:
        static_f, static_r = car.static_loads()
        moved = (F_x - drag) * body.h / L
        means = [(static_f + down_f - moved) / 2.0, (static_r + down_r + moved) / 2.0]
        acrosses = [without_lifting(gain * a_y, mean) for gain, mean in zip(car.load_transfer_gains(), means)]
    # ISO-W: the slip angle is positive while the contact point moves to the left.
    alpha_f = ca.atan((v_y + body.l_f * r + sideways[0]) / v_x) - delta
    alpha_r = ca.atan((v_y - body.l_r * r + sideways[1]) / v_x)

    def axle_forces(tire: Tire, slips, alpha, mean, across):
        """Sums of the forces, and the longitudinal one of the right wheel minus that of the left one."""
        # A tire without shifts is its own mirror image.
        left, right = (tire.forces(slip, alpha, mean + side * across) for slip, side in zip(slips, (-1.0, 1.0)))
        return left[0] + right[0], left[1] + right[1], right[0] - left[0]

    F_xf, F_yf, uneven_f = axle_forces(car.tire_f, kappas[:2], alpha_f, means[0], acrosses[0])
    F_xr, F_yr, uneven_r = axle_forces(car.tire_r, kappas[2:], alpha_r, means[1], acrosses[1])
    along_f = F_xf * ca.cos(delta) - F_yf * ca.sin(delta)
    across_body_f = F_xf * ca.sin(delta) + F_yf * ca.cos(delta)
    time_over_way = slowness(n, xi, v_x, v_y, curvature)
    rates = ca.vertcat(
        v_x * ca.sin(xi) + v_y * ca.cos(xi),
        r - curvature / time_over_way,
        (along_f + F_xr - drag) / body.m + v_y * r,
        (across_body_f + F_yr) / body.m - v_x * r,
        (body.l_f * across_body_f - body.l_r * F_yr + (body.track_f * uneven_f + body.track_r * uneven_r) / 2.0) / body.I_zz,
        delta_rate,
        F_x_rate,
        *body_rates,
    )
    effort = (delta_rate / limit.delta_rate) ** 2 + (F_x_rate / limit.F_x_rate) ** 2
    asked_f, asked_r = car.split_force(F_x)
    lateral_force = body.m * a_y
    # Brakes and an open differential pull alike on both sides.
    equations = ca.vertcat(F_xf - asked_f, F_xr - asked_r, uneven_f, uneven_r, across_body_f + F_yr - lateral_force) / weight
    beyond_peak_f, beyond_peak_r = (alpha_f / car.tire_f.peak()) ** 2 - 1.0, (alpha_r / car.tire_r.peak()) ** 2 - 1.0
    share = car.drive.front_share
    driven_slip = share * (kappas[0] + kappas[1]) / 2.0 + (1.0 - share) * (kappas[2] + kappas[3]) / 2.0
    inequalities = ca.vertcat(F_x * v_x * (1.0 + driven_slip) / limit.power - 1.0, beyond_peak_f, beyond_peak_r)
    slopes = rates * time_over_way / scale[: len(car.states())]
    price = time_over_way * (1.0 + SMOOTHNESS * effort)
    return ca.Function("node", [x, curvature], [time_over_way, price, slopes, equations, inequalities])


def start_speeds(car: Car, kappa, step: float, closed: bool):
    """Speeds [m/s] on the line with a reserve of grip, by one pass forwards and one backwards."""
    grip = START_GRIP * G * min(car.tire_f.D, car.tire_r.D)
    v = np.minimum(np.sqrt(grip / np.maximum(np.abs(kappa), 1e-6)), 0.7 * car.top_speed())
    nodes = len(v)
    rounds = range(2 * nodes if closed else nodes - 1)
    for k in rounds:
        a_x = min(0.5 * grip, car.limit.power / (car.body.m * v[k % nodes]))
        v[(k + 1) % nodes] = min(v[(k + 1) % nodes], np.sqrt(v[k % nodes] ** 2 + 2.0 * a_x * step))
    for k in reversed(rounds):
        v[k % nodes] = min(v[k % nodes], np.sqrt(v[(k + 1) % nodes] ** 2 + 2.0 * grip * step))
    return v


def start(car: Car, kappa, step: float, closed: bool):
    """Unknowns at the nodes: along the line, without slip."""
    v_x = start_speeds(car, kappa, step, closed)
    x = dict.fromkeys(car.variables(), np.zeros(len(kappa)))
    a_x = v_x * np.gradient(v_x, step)
    drag = car.aero.force_per_coefficient(v_x) * car.aero.C_d
    x |= {"v_x": v_x, "r": v_x * kappa, "delta": (car.body.l_f + car.body.l_r) * kappa, "F_x": car.body.m * a_x + drag, "a_y": v_x**2 * kappa}
    return np.array([x[name] for name in car.variables()])


@dataclass
class Optimum:
    """A solution as IPOPT left it; unknowns in their units, a row for each and a column for each node."""

    x: np.ndarray
    status: str
    solved: bool
    iterations: int
    seconds: float


def solve(car: Car, track: Track, nodes: int, margin: float) -> Optimum:
    limit = car.limit
    s = track.node_stations(nodes)
    kappa = track.curvature(s)
    step = track.length / (nodes if track.closed else nodes - 1)
    scale, variables = car.sizes(), car.variables()

    X = ca.MX.sym("X", len(variables), nodes)
    _, price, slopes, equations, inequalities = node_function(car).map(nodes)(X, kappa.reshape(1, -1))
    states = X[: len(car.states()), :]
    here, behind = list(range(nodes - 1)), list(range(1, nodes))
    if track.closed:
        here, behind = here + [nodes - 1], behind + [0]
    ties = states[:, behind] - states[:, here] - step / 2.0 * (slopes[:, here] + slopes[:, behind])
    constraints = [ca.vec(ties), ca.vec(equations), ca.vec(inequalities)]
    problem = {"x": ca.vec(X), "f": ca.dot(price, track.node_ways(nodes).reshape(1, -1)), "g": ca.vertcat(*constraints)}

    most = {"xi": MOST_XI, "v_y": MOST_V_Y, "r": MOST_R, "delta": limit.delta, "delta_rate": limit.delta_rate}
    most |= {"F_x_rate": limit.F_x_rate, "a_y": MOST_A_Y}
    most |= {name: (car.tire_f if "_f" in name else car.tire_r).peak() for name in SLIPS}
    most |= {"z": MOST_HEAVE, "phi": MOST_ANGLE, "theta": MOST_ANGLE}
    most |= dict.fromkeys(("z_rate", "phi_rate", "theta_rate"), MOST_BODY_RATE)
    bounds = {name: (-bound, bound) for name, bound in most.items()}
    bounds |= {"v_x": (SLOWEST, car.top_speed()), "F_x": (limit.F_x_min, limit.F_x_max)}
    bounds["n"] = track.deviation_bounds(s, margin)
    lower, upper = (np.array([np.broadcast_to(bounds[it][side], nodes) for it in variables]) for side in (0, 1))
    if not track.closed:
        straight = [variables.index(it) for it in ("xi", "v_y", "r")]
        lower[straight, 0], upper[straight, 0] = -START_TOLERANCE, START_TOLERANCE
    count, free = int(problem["g"].numel()), int(inequalities.numel())
    lower_g = np.concatenate([np.zeros(count - free), np.full(free, -np.inf)])

    # A lower first barrier than IPOPT's own leads from starts with little or much grip to one minimum of several.
    settings = {"tol": 1e-8, "max_iter": 1000, "mu_init": 0.01, "print_level": 0, "sb": "yes"}
    solver = ca.nlpsol("lap", "ipopt", problem, {"expand": True, "print_time": False, "ipopt": settings})

    def scaled(values):
        return (values / scale[:, None]).flatten(order="F")

    began = time.perf_counter()
    found = solver(
        x0=scaled(np.clip(start(car, kappa, step, track.closed), lower, upper)),
        lbx=scaled(lower), ubx=scaled(upper), lbg=lower_g, ubg=np.zeros(count),
    )
    seconds = time.perf_counter() - began
    x = np.array(found["x"]).reshape((len(variables), nodes), order="F") * scale[:, None]
    report = solver.stats()
    return Optimum(x, report["return_status"], report["success"], report["iter_count"], seconds)


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__)
    for name in "car", "track", "lap":
        arguments.add_argument(name, type=Path)
    arguments.add_argument("--nodes", type=int, help="number of nodes; that of the lap without it")
    arguments.add_argument("--margin", type=float, default=0.9, help="least way to an edge [m]")
    arguments.add_argument("--transients", action="store_true", help="the body swings on its springs")
    chosen = arguments.parse_args()
    car, track = Car.from_toml(chosen.car, chosen.transients), Track.from_csv(chosen.track)
    lap = Lap.from_csv(chosen.lap, track)
    nodes = chosen.nodes or len(lap.s)
    optimum = solve(car, track, nodes, chosen.margin)
    n, xi, v_x, v_y = optimum.x[:4]
    fastest = lap_time(track, n, xi, v_x, v_y)
    period = track.length if track.closed else None
    n_lap = np.interp(track.node_stations(nodes), lap.s, lap.n, period=period)
    result = {
        "lap_time": fastest,
        "status": optimum.status,
        "iterations": optimum.iterations,
        "seconds": optimum.seconds,
        "lap_time_difference": abs(lap.time - fastest) / fastest,
        "largest_deviation": float(np.max(np.abs(n - n_lap))),
    }
    print(json.dumps(result))
    if not optimum.solved:
        print(f"IPOPT did not find the fastest lap: {optimum.status}", file=sys.stderr)
    return 0 if optimum.solved else 1


if __name__ == "__main__":
    sys.exit(main())
