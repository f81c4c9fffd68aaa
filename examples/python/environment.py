"""A car that is to change its lane, as an environment in the form of gymnasium: reset, step, action_space, observation_space.

gymnasium and numpy are used when they are installed; without them spaces are those below, and an observation is a list.

    python examples/python/environment.py        drives an episode with a simple controller
"""

from __future__ import annotations

import random
from typing import Any

import trackside

try:
    import gymnasium
    import numpy
    from gymnasium.spaces import Box

    Base: type = gymnasium.Env
except ImportError:
    Base = object

    class Box:  # type: ignore[no-redef]
        """Numbers between bounds, as gymnasium.spaces.Box."""

        def __init__(self, low: float, high: float, shape: tuple[int, ...]) -> None:
            self.low, self.high, self.shape = low, high, shape

        def sample(self) -> list[float]:
            """Draw an element."""
            return [random.uniform(self.low, self.high) for _ in range(self.shape[0])]


class LaneChange(Base):  # type: ignore[misc]
    """Steer a car 3.5 m to the left within 4 s. An action lasts 0.05 s; the reward is what is missing, negative."""

    metadata: dict[str, Any] = {"render_modes": []}
    render_mode = None

    #: Steering angle of an action of 1 [rad].
    DELTA = 0.06
    #: The other lane [m], and where the road ends.
    LANE, EDGE = 3.5, 6.0
    #: Communication steps of an action.
    STEPS = 5
    #: What the driver sees, and what is large for each.
    SEEN = {"plant.Y": 6.0, "plant.psi": 0.5, "plant.v_y": 2.0, "plant.r": 1.0}

    def __init__(self, scenario: str = "step_steer") -> None:
        self.action_space = Box(-1.0, 1.0, (1,))
        self.observation_space = Box(-10.0, 10.0, (len(self.SEEN),))
        self.session = trackside.Session(scenario)
        # Going back to a state takes microseconds, a new initialisation milliseconds.
        self.start = self.session.save()

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin an episode; `options={"Y": …}` moves the wanted lane [m]."""
        if Base is not object:
            super().reset(seed=seed)
        self.lane = (options or {}).get("Y", self.LANE)
        self.session.restore(self.start)
        return self.observation(), {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Steer for one action: the observation, the reward, whether the road ended, whether the time ended, and values to look at."""
        session = self.session
        session["plant.delta"] = self.DELTA * max(-1.0, min(1.0, float(action[0])))
        session.step(self.STEPS)
        Y = session["plant.Y"]
        terminated, truncated = abs(Y) > self.EDGE, session.time > session.stop_time - 1e-9
        return self.observation(), -abs(Y - self.lane), terminated, truncated, {"Y": Y, "a_y": session["plant.a_y"]}

    def observation(self) -> Any:
        """What the driver sees, as shares of what is large, within the bounds of the space."""
        seen = [max(-10.0, min(10.0, self.session[name] / large)) for name, large in self.SEEN.items()]
        return seen if Base is object else numpy.array(seen, numpy.float32)

    def close(self) -> None:
        """Free the car."""
        self.session.close()


def drive(environment: LaneChange) -> tuple[float, dict[str, Any]]:
    """Drive an episode with a proportional controller of lane and heading; the sum of rewards, and the last values."""
    seen, _ = environment.reset(seed=1)
    total = 0.0
    while True:
        Y, psi, _, r = (value * large for value, large in zip(seen, environment.SEEN.values()))
        psi_ref = max(-0.1, min(0.1, 0.05 * (environment.lane - Y)))
        seen, reward, terminated, truncated, info = environment.step([(0.6 * (psi_ref - psi) - 0.06 * r) / environment.DELTA])
        total += reward
        if terminated or truncated:
            return total, info


if __name__ == "__main__":
    environment = LaneChange()
    total, info = drive(environment)
    environment.close()
    print(f"sum of rewards {total:.1f}, at the end Y = {info['Y']:.2f} m")
