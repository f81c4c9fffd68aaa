"""Reads tire property files and evaluates their Magic Formula, without a line of ours: numbers to stdout as JSON, a file a line.

Equations: Pacejka, Tire and Vehicle Dynamics, third edition, 4.3.2, for 6.1 and 6.2; the same with camber as in 5.2 and PAC2002, where
S_Hy has PHY3 and no K_ygamma; pressure of PAC2002 as in the documentation of Adams Tire and in ChPac02Tire.cpp of Project Chrono.
Files are read by what their lines say: only SI units.
"""

import json
import re
import sys
from math import atan, copysign, exp, sin

NUMBER = re.compile(r"^\s*([A-Za-z_0-9]+)\s*=\s*([-+.0-9eEdD]+)\s*(?:[$!].*)?$")
WORD = re.compile(r"^\s*([A-Za-z_0-9]+)\s*=\s*'([^']*)'")


def parse(path):
    numbers, words = {}, {}
    with open(path, encoding="latin-1", newline=None) as lines:
        for line in lines:
            if found := NUMBER.match(line):
                numbers[found[1].upper()] = float(found[2].replace("D", "e").replace("d", "e"))
            elif found := WORD.match(line):
                words[found[1].upper()] = found[2].strip().upper()
    return numbers, words


class Tire:
    def __init__(self, path):
        self.c, words = parse(path)
        kind = self.c.get("FITTYP")
        self.pac2002 = words.get("PROPERTY_FILE_FORMAT") == "PAC2002"
        of_5 = words.get("PROPERTY_FILE_FORMAT", "") in ("MF_05", "MF52")
        self.old = self.pac2002 or kind in (5, 6, 21, 50, 51, 52) or (kind is None and of_5)
        right = words.get("TYRESIDE") == "RIGHT"
        self.mirror = right != (self.c.get("USE_MODE", 0) < 0)
        pressure = self.c.get("INFLPRES", self.c.get("IP"))
        nominal = self.c.get("NOMPRES", self.c.get("IP_NOM"))
        both = pressure is not None and nominal is not None and (self.pac2002 or not self.old)
        self.dpi = (pressure - nominal) / nominal if both else 0.0

    def __getattr__(self, name):
        neutral = 1.0 if name.startswith("L") or name in ("PCX1", "PCY1", "PKY2") else 0.0
        if name == "LKYC":
            return self.c.get("LKYC", self.c.get("LKYG", 1.0))
        if name == "PKY4":
            return 2.0 if self.old else self.c.get(name, 2.0)
        newer = name in ("PKY5", "PKY6", "PKY7", "PEY5", "PPY5")
        return neutral if self.old and newer else self.c.get(name, neutral)

    @property
    def nominal(self):
        return self.FNOMIN * self.LFZO

    @staticmethod
    def curve(B, C, D, E, x):
        return D * sin(C * atan(B * x - E * (B * x - atan(B * x))))

    def F_x(self, kappa, F_z):
        d, p = (F_z - self.nominal) / self.nominal, self.dpi
        mu = (self.PDX1 + self.PDX2 * d) * (1 + self.PPX3 * p + self.PPX4 * p * p) * self.LMUX
        K = F_z * (self.PKX1 + self.PKX2 * d) * exp(self.PKX3 * d) * (1 + self.PPX1 * p + self.PPX2 * p * p) * self.LKX
        x = kappa + (self.PHX1 + self.PHX2 * d) * self.LHX
        E = (self.PEX1 + self.PEX2 * d + self.PEX3 * d * d) * (1 - self.PEX4 * ((x > 0) - (x < 0))) * self.LEX
        C = self.PCX1 * self.LCX
        shift = F_z * (self.PVX1 + self.PVX2 * d) * self.LVX * self.LMUX
        return self.curve(K / (C * mu * F_z), C, mu * F_z, min(E, 1), x) + shift

    def F_y(self, alpha, gamma, F_z):
        if self.mirror:
            return -self.side(-alpha, -gamma, F_z)
        return self.side(alpha, gamma, F_z)

    def side(self, alpha, gamma, F_z):
        d, p, g = (F_z - self.nominal) / self.nominal, self.dpi, gamma
        if self.old:
            g = gamma * self.LGAY
        mu = (self.PDY1 + self.PDY2 * d) * (1 - self.PDY3 * g * g) * (1 + self.PPY3 * p + self.PPY4 * p * p) * self.LMUY
        load = (self.PKY2 + self.PKY5 * g * g) * (1 + self.PPY2 * p) * self.nominal
        K = self.PKY1 * self.nominal * (1 + self.PPY1 * p) * (1 - self.PKY3 * abs(g)) * sin(self.PKY4 * atan(F_z / load)) * self.LKY
        by_camber = F_z * (self.PVY3 + self.PVY4 * d) * g * self.LKYC * self.LMUY
        S_V = F_z * (self.PVY1 + self.PVY2 * d) * self.LVY * self.LMUY + by_camber
        S_H = (self.PHY1 + self.PHY2 * d) * self.LHY
        if self.old:
            S_H += self.PHY3 * g * self.LKYC
        else:
            K_camber = F_z * (self.PKY6 + self.PKY7 * d) * (1 + self.PPY5 * p) * self.LKYC
            S_H += (K_camber * g - by_camber) / K
        x = alpha + S_H
        E = (self.PEY1 + self.PEY2 * d) * (1 + self.PEY5 * g * g - (self.PEY3 + self.PEY4 * g) * copysign(1, x)) * self.LEY
        C = self.PCY1 * self.LCY
        return self.curve(K / (C * mu * F_z), C, mu * F_z, min(E, 1), x) + S_V

    def figures(self):
        F_z, h = self.nominal, 1e-5
        top = 0.6
        alphas = [top * i / 2000 for i in range(1, 2001)]
        sideways = min(top, -self.c.get("ALPMIN", -1.5))
        ahead, back = min(top, self.c.get("KPUMAX", 1.5)), min(top, -self.c.get("KPUMIN", -1.5))
        # The slope of the curve itself, at the slip where it passes its shift: there it is B C D.
        offset = (self.PHY1) * self.LHY * (-1 if self.mirror else 1)
        slope = (self.F_y(h - offset, 0, F_z) - self.F_y(-h - offset, 0, F_z)) / (2 * h)
        camber = (self.F_y(0, h, F_z) - self.F_y(0, -h, F_z)) / (2 * h)
        return {
            "lateral friction": max(self.F_y(-a * sideways / top, 0, F_z) for a in alphas) / F_z,
            "driving friction": max(self.F_x(a * ahead / top, F_z) for a in alphas) / F_z,
            "braking friction": max(-self.F_x(-a * back / top, F_z) for a in alphas) / F_z,
            "cornering stiffness": -slope,
            "camber stiffness": -camber,
        }


for name in sys.argv[1:]:
    print(json.dumps({"file": name, "figures": Tire(name).figures()}))
