"""Small components that together use everything a component can declare."""

import casadi as ca

from components.framework import (
    CalculatedParameter,
    Component,
    Condition,
    Input,
    Output,
    Parameter,
    PythonComponent,
    State,
)


class Swing(Component):
    """A nonlinear plant: three states, a matrix parameter, calculated and tunable parameters, conditions."""

    solver_step = 1e-3

    J = Parameter(unit="kg.m2", shape=(2, 2), start=((2.0, 0.3), (0.3, 1.5)), doc="inertia")
    stiffness = Parameter(unit="N.m", start=1.7, tunable=True, doc="stiffness")
    drive = Parameter(unit="1/s", start=0.9, doc="rate of the phase")
    J_inverse = CalculatedParameter(unit="1/(kg.m2)", shape=(2, 2), doc="inverse inertia")
    soft = CalculatedParameter(unit="N.m", doc="half the stiffness")
    torque = Input(unit="N.m", shape=(2,), start=(0.1, -0.2), doc="torque")
    omega = State(unit="rad/s", shape=(2,), start=(0.3, -0.1), output=True, doc="rate")
    phase = State(unit="rad", start=0.2, doc="phase")
    energy = Output(unit="J", doc="kinetic energy")
    applied = Output(unit="N.m", shape=(2,), doc="torque with feedthrough and time")

    def calculate(self, p):
        return {"J_inverse": ca.inv(p.J), "soft": 0.5 * p.stiffness}

    def derivatives(self, t, x, u, p):
        swing = ca.vertcat(p.stiffness * ca.sin(x.phase), p.soft * ca.cos(2 * x.phase) * x.omega[0])
        return {"omega": p.J_inverse @ (u.torque - swing), "phase": p.drive + x.omega[1] * ca.sin(t)}

    def outputs(self, t, x, u, p):
        return {
            "energy": 0.5 * x.omega.T @ p.J @ x.omega,
            "applied": u.torque * ca.cos(x.phase) + ca.vertcat(t, p.soft) * x.omega,
        }

    def check(self, t, x, u, p):
        return [
            Condition(
                ca.det(p.J),
                "J is not positive definite (determinant {} kg2.m4, J[1,1] = {}).",
                (ca.det(p.J), p.J[0, 0]),
            ),
            Condition(p.drive, 'drive = {} 1/s must be positive, "100 %" sure.', (p.drive,)),
        ]


class Wheel(Component):
    """A wheel whose torque is a step mean, and whose start value is calculated."""

    inertia = Parameter(unit="kg.m2", start=0.4, doc="inertia")
    friction = Parameter(unit="N.m.s/rad", start=0.05, doc="viscous friction")
    momentum_limit = CalculatedParameter(unit="N.m.s", doc="limit")
    command = Input(unit="N.m", start=0.2, doc="commanded torque")
    body_rate = Input(unit="rad/s", start=0.1, doc="rate of the body")
    speed = State(unit="rad/s", calculated=True, output=True, doc="speed")
    angle = State(unit="rad", start=0.5, doc="angle")
    offset = State(unit="rad", calculated=True, doc="a calculated state that is no output")
    torque = Output(unit="N.m", step_mean=True, doc="torque on the body")
    momentum = Output(unit="N.m.s", doc="momentum")

    def calculate(self, p):
        return {"momentum_limit": p.inertia**2 * 300}

    def initial(self, t, x, u, p):
        return {"speed": u.command / p.inertia + x.angle * u.body_rate, "offset": p.friction * x.angle + ca.sin(t)}

    def derivatives(self, t, x, u, p):
        acceleration = (u.command - p.friction * x.speed) / p.inertia
        return {"speed": acceleration, "angle": x.speed + 0.1 * ca.cos(x.offset), "offset": u.body_rate * x.angle}

    def step_means(self, t, x, p):
        return {"torque": -p.inertia * x.speed - 0.01 * t * ca.sin(x.offset)}

    def outputs(self, t, x, u, p):
        return {"momentum": ca.fmin(p.inertia * (x.speed + u.body_rate), p.momentum_limit)}


class Turntable(Component):
    """Two exact outputs: users set rates, what is integrated are momenta, which contain a stored one."""

    solver_step = 1e-3

    J = Parameter(unit="kg.m2", shape=(2, 2), start=((2.0, 0.3), (0.3, 1.5)), doc="inertia")
    spring = Parameter(unit="N.m/rad", start=0.7, doc="spring")
    J_inverse = CalculatedParameter(unit="1/(kg.m2)", shape=(2, 2), doc="inverse inertia")
    stored = Input(unit="N.m.s", shape=(2,), start=(0.2, -0.1), doc="momentum of a wheel inside")
    energy = Output(unit="J", doc="kinetic energy")
    angle = State(unit="rad", shape=(2,), start=(0.3, 0.1), output=True, doc="angles")
    L = State(unit="N.m.s", shape=(2,), calculated=True, doc="total momentum")
    omega = Output(unit="rad/s", shape=(2,), start=(0.1, 1 / 3), exact=True, doc="rates")

    def calculate(self, p):
        return {"J_inverse": ca.inv(p.J)}

    def initial(self, t, x, u, p):
        return {"L": (1 + 0.1 * ca.sin(x.angle[0])) * (p.J @ x.omega) + u.stored}

    def derivatives(self, t, x, u, p):
        return {"angle": self._rates(x, u, p), "L": -p.spring * x.angle}

    def outputs(self, t, x, u, p):
        omega = self._rates(x, u, p)
        return {"omega": omega, "energy": 0.5 * omega.T @ p.J @ omega}

    def _rates(self, x, u, p):
        return p.J_inverse @ (x.L - u.stored) / (1 + 0.1 * ca.sin(x.angle[0]))


class Integrator(Component):
    """x' = u, for the interpolation of inputs."""

    u = Input(unit="m/s", shape=(2,), doc="rate")
    x = State(unit="m", shape=(2,), output=True, doc="integral")

    def derivatives(self, t, x, u, p):
        return {"x": u.u}


class Blowup(Component):
    """x' = 1000 x^2: the second state escapes at 0.1 s."""

    solver_step = 0.01
    bias = Input(unit="rad/s", doc="not used for much")
    x = State(unit="rad", shape=(2,), start=(0.0, 0.01), output=True, doc="escapes")

    def derivatives(self, t, x, u, p):
        return {"x": 1e3 * x.x**2 + 0 * u.bias}


class Sum(Component):
    """A sampled integrator with feedthrough, time dependence, and a calculated start value."""

    sample_time = 0.1
    gain = Parameter(unit="1", start=2.0, tunable=True, doc="gain")
    double_gain = CalculatedParameter(unit="1", doc="twice the gain")
    u = Input(unit="1", start=0.25, doc="input")
    total = State(unit="1", start=0.5, output=True, doc="sum")
    last = State(unit="1", calculated=True, doc="the last input")
    shown = Output(unit="1", doc="sum, input and time at the sample")

    def calculate(self, p):
        return {"double_gain": 2 * p.gain}

    def initial(self, t, x, u, p):
        return {"last": u.u * p.gain}

    def update(self, t, x, u, p):
        return {"total": x.total + p.double_gain * u.u + 0.1 * x.last, "last": u.u}

    def outputs(self, t, x, u, p):
        return {"shown": x.total * (1 + ca.sin(t)) + 10 * u.u}


class Gain(Component):
    """Stateless: y = k(t) u."""

    k = Parameter(unit="1", start=3.0, tunable=True, doc="gain")
    u = Input(unit="N", start=0.5, doc="input")
    y = Output(unit="N", doc="output")

    def outputs(self, t, x, u, p):
        return {"y": p.k * u.u * (1 + t)}


class Modes(Component):
    """Any number of modes, none at all included."""

    modes: int = 0
    Omega = Parameter(unit="rad/s", shape=("modes",), start=2.0, doc="frequency")
    omega_squared = CalculatedParameter(unit="1/s2", shape=("modes",), doc="square of the frequency")
    force = Input(unit="kg^(1/2).m/s2", shape=("modes",), doc="force")
    eta = State(unit="kg^(1/2).m", shape=("modes",), start=0.1, output=True, doc="coordinate")
    eta_dot = State(unit="kg^(1/2).m/s", shape=("modes",), doc="rate")
    strain = Output(unit="kg^(1/2).m", shape=("modes",), doc="twice the coordinate")

    def calculate(self, p):
        return {"omega_squared": p.Omega**2}

    def derivatives(self, t, x, u, p):
        return {"eta": x.eta_dot, "eta_dot": u.force - p.omega_squared * x.eta}

    def outputs(self, t, x, u, p):
        return {"strain": 2 * x.eta}


class Autonomous(Component):
    """One state, no input, no output but the state."""

    x = State(unit="m", start=1.0, output=True, doc="decays")

    def derivatives(self, t, x, u, p):
        return {"x": -0 * t - x.x / 1}


class Clock(Component):
    """Sampled, without states and inputs."""

    sample_time = 0.25
    y = Output(unit="s", doc="time of the last sample")

    def outputs(self, t, x, u, p):
        return {"y": t}


class Plain(PythonComponent):
    """A component in plain Python."""

    u = Input(unit="1", doc="input")
    y = Output(unit="1", doc="output")

    def outputs(self, t, x, u, p):
        return {"y": u.u}


class Braces(Component):
    """A component without any variable that moves."""

    k = Parameter(unit="1", start=-1.0, doc="number")
    y = Output(unit="1", doc="the same")

    def outputs(self, t, x, u, p):
        return {"y": p.k}

    def check(self, t, x, u, p):
        return [Condition(p.k, "{{k}} = {} ??/ \\ Ω %d", (p.k,))]


def every() -> dict[str, Component]:
    """Return one of each that can be native, by name."""
    parts = [Swing(), Wheel(), Turntable(), Integrator(), Blowup(), Sum(), Gain(), Autonomous(), Clock()]
    return {p.name: p for p in parts} | {f"Modes_{n}": Modes(modes=n) for n in (0, 2)}
