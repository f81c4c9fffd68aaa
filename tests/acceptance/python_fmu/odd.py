"""A model that does what its start value says: see python_fmus.rs."""
import os
import random
import signal
import sys
import time

from trackside.fmu import Model, Terminate, input, output, parameter

print("the script is loaded")


class Odd(Model):
    """Does what `how` says from 0.5 s on."""

    step_size = 0.1
    patience = 2.0

    how = parameter("nothing")
    u = input(0.0)
    n = input(1)
    on = input(False)
    word = input("a")
    y = output()
    n_out = output(0)
    on_out = output(False)
    word_out = output("")

    def __init__(self):
        self.random = random.Random(7)
        self.sum = 0.0

    def initialise(self):
        print("begins with", self.how)
        if self.how == "begins":
            raise ValueError("cannot begin")
        self.step(self.time, 0.0)

    def step(self, t, h):
        self.sum += self.u * h
        self.y = self.sum + self.random.random()
        self.n_out, self.on_out, self.word_out = 2 * self.n, not self.on, self.word + "b"
        if t < 0.45:
            return
        if self.how == "raises":
            raise ZeroDivisionError("nothing left")
        if self.how == "hangs":
            while True:
                pass
        if self.how == "sleeps":
            time.sleep(1e6)
        if self.how == "dies":
            os.kill(os.getpid(), signal.SIGKILL)
        if self.how == "leaves":
            os._exit(0)
        if self.how == "exits":
            sys.exit("enough")
        if self.how == "a text":
            self.y = "much"
        if self.how == "a half":
            self.n_out = 1.5
        if self.how == "too large":
            self.n_out = 2**31
        if self.how == "no truth":
            self.on_out = "yes"
        if self.how == "NaN":
            self.y = float("nan")
        if self.how == "ends":
            raise Terminate("the track is over")
        if self.how == "talks":
            os.write(1, b"past Python\n")
            for line in range(20_000):
                print("line", line, "x" * 40)
