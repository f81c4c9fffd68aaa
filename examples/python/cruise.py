"""Cruise control: holds a speed by the force of the engine."""

from trackside.fmu import Model, input, local, output, parameter


class Cruise(Model):
    """Holds a speed, with an integrator that waits while the force is at its limit."""

    step_size = 0.01

    k_p = parameter(900.0, unit="N.s/m", name="gain.p", doc="Proportional gain")
    k_i = parameter(150.0, unit="N/m", name="gain.i", doc="Integral gain", tunable=True)
    F_max = parameter(4000.0, unit="N", doc="Largest force", min=0.0)
    v_ref = input(20.0, unit="m/s", doc="Wanted speed")
    v = input(0.0, unit="m/s", doc="Speed")
    F = output(unit="N", doc="Force")
    limited = output(False, doc="Whether the force is at its limit")
    missing = local(unit="m", doc="Sum of the error")

    def step(self, t, h):
        error = self.v_ref - self.v
        force = self.k_p * error + self.k_i * (self.missing + error * h)
        self.limited = abs(force) > self.F_max
        if not self.limited:
            self.missing += error * h
        self.F = max(-self.F_max, min(self.F_max, force))
