"""Makes FMUs by pythonfmu, one with variables of all types: make_fmu.py FOLDER; prints Python's library and the archives"""
import pathlib
import subprocess
import sys
import sysconfig

MODEL = """
from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real, String


class Demo(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.u, self.y, self.count, self.n = 0.0, 0.0, 0, 0
        self.on, self.b, self.label, self.s = False, False, "", ""
        self.k, self.k_out, self.c, self.c_out, self.t, self.t_out = 0, 0, False, False, "", ""
        tunable = dict(causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable)
        given = dict(causality=Fmi2Causality.input, variability=Fmi2Variability.discrete)
        discrete = dict(causality=Fmi2Causality.output, variability=Fmi2Variability.discrete)
        self.register_variable(Real("u", causality=Fmi2Causality.input))
        self.register_variable(Real("y", causality=Fmi2Causality.output))
        for variable in Integer("count", **tunable), Boolean("on", **tunable), String("label", **tunable):
            self.register_variable(variable)
        for variable in Integer("k", **given), Boolean("c", **given), String("t", **given):
            self.register_variable(variable)
        for variable in Integer("k_out", **discrete), Boolean("c_out", **discrete), String("t_out", **discrete):
            self.register_variable(variable)
        for variable in Integer("n", **discrete), Boolean("b", **discrete), String("s", **discrete):
            self.register_variable(variable)

    def do_step(self, time, step):
        assert self.on and self.label == "hello", (self.on, self.label)
        self.y, self.n, self.b = self.count * self.u, self.n + 1, not self.b
        self.s = f"{self.label} {self.n}"
        self.k_out, self.c_out, self.t_out = self.k, self.c, self.t
        return True
"""

INTEGRATOR = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Integrator(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.u, self.y, self.gain = 0.0, 0.0, 2.0
        tunable = dict(causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable)
        self.register_variable(Real("u", causality=Fmi2Causality.input))
        self.register_variable(Real("y", causality=Fmi2Causality.output))
        self.register_variable(Real("gain", **tunable))

    def do_step(self, time, step):
        self.y += self.gain * self.u * step
        return True
"""

folder = pathlib.Path(sys.argv[1])
folder.mkdir(parents=True)
archives = []
for name, text in ("Demo", MODEL), ("Integrator", INTEGRATOR):
    model = folder / f"{name.lower()}.py"
    model.write_text(text)
    build = [sys.executable, "-m", "pythonfmu", "build", "-f", str(model), "-d", str(folder)]
    subprocess.run(build, check=True, stdout=subprocess.DEVNULL)
print(pathlib.Path(sysconfig.get_config_var("LIBDIR")) / sysconfig.get_config_var("INSTSONAME"))
print(folder / "Demo.fmu")
print(folder / "Integrator.fmu")
