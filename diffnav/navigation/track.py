"""A flight's fixes, one after the other: jumps are rejected, gaps are bridged with growing uncertainty."""

import math
from dataclasses import dataclass, fields, replace
from datetime import datetime, timedelta
from typing import NamedTuple

import numpy as np

from diffnav.errors import UserError
from diffnav.geometry.geodesy import moved, offset_m
from diffnav.navigation.fix import Fix
from diffnav.navigation.prior import NOTHING, Prior

# Squared Mahalanobis distance in the plane that one in a thousand right fixes exceeds: -2 log .001.
_GATE = 13.8


@dataclass(frozen=True)
class Motion:
    """How a vehicle flies.

    speed_m_s: usual at most, of which nothing is known before the second fix. acceleration_m_s2: standard deviation.
    interval_s: between pictures without times, and where the clock was set back. floor_m: of a fix's standard
    deviation, for what its inliers cannot know: the map's own error, relief. coast_m: standard deviation at which an
    expected place is no longer told. restart: fixes in a row that must be rejected and agree before the track believes
    them.
    Raises: UserError for a setting that is not above 0.
    """

    speed_m_s: float = 20.0
    acceleration_m_s2: float = 2.0
    interval_s: float = 1.0
    floor_m: float = 3.0
    coast_m: float = 50.0
    restart: int = 3

    def __post_init__(self) -> None:
        for setting in fields(self):
            value = getattr(self, setting.name)
            if not 0 < value < math.inf:
                raise UserError(f"motion.{setting.name} must be above 0, got {value}")


class _Rejected(NamedTuple):
    """A fix that jumped: metres east and north, variance, and the track's clock."""

    place: np.ndarray
    sigma2: float
    clock_s: float


class Track:
    """Constant-velocity Kalman filter over the places of a flight, in metres east and north of its first fix.

    Source: Bar-Shalom, Li & Kirubarajan 2001, section 6.3.2 (discrete white noise acceleration), 5.4 (gating).
    """

    def __init__(self, motion: Motion | None = None) -> None:
        self.motion = motion or Motion()
        self._origin: np.ndarray | None = None
        self._state, self._covariance = np.zeros(4), np.zeros((4, 4))
        self._time: datetime | None = None
        self._clock_s = 0.0
        self._rejected: list[_Rejected] = []

    def expected(self, time: datetime | None = None) -> Prior:
        """Where the next picture should lie, within four standard deviations; nothing before the first fix."""
        if self._origin is None:
            return NOTHING
        state, covariance = self._predicted(self._seconds_until(time))
        sigma_m = _sigma_m(covariance)
        return Prior(self._place(state), 4 * sigma_m + 4 * self.motion.floor_m)

    def update(self, fix: Fix) -> Fix:
        """The fix itself; or, where it jumps or is missing, the expected place (`coasted`), or no fix once unsure."""
        seconds = self._pass(fix.time)
        if self._origin is None:
            if fix.status == "fix":
                self._start(fix)
            return fix
        self._state, self._covariance = self._predicted(seconds)
        if fix.status != "fix":
            return self._coasted(fix)
        distance_m, mahalanobis = self._distance(fix)
        if mahalanobis > _GATE and not self._is_restart(fix):
            return self._coasted(replace(fix, reasons=(f"jumps {distance_m:.0f} m from the expected place",)))
        if mahalanobis > _GATE:
            self._start(fix)
            return fix
        self._correct(fix)
        self._rejected.clear()
        return fix

    def _start(self, fix: Fix) -> None:
        self._origin = np.array(fix.place)
        sigma2 = self._sigma2(fix)
        self._state = np.zeros(4)
        self._covariance = np.diag([sigma2, sigma2, self.motion.speed_m_s**2, self.motion.speed_m_s**2])
        self._rejected.clear()

    def _predicted(self, seconds: float) -> tuple[np.ndarray, np.ndarray]:
        F = np.eye(4)
        F[0, 2] = F[1, 3] = seconds
        G = np.concatenate([np.eye(2) * seconds**2 / 2, np.eye(2) * seconds])
        return F @ self._state, F @ self._covariance @ F.T + self.motion.acceleration_m_s2**2 * G @ G.T

    def _distance(self, fix: Fix) -> tuple[float, float]:
        """Metres from the expected place, and the squared Mahalanobis distance."""
        innovation = self._measured(fix) - self._state[:2]
        spread = self._covariance[:2, :2] + np.eye(2) * self._sigma2(fix)
        return float(np.linalg.norm(innovation)), float(innovation @ np.linalg.solve(spread, innovation))

    def _correct(self, fix: Fix) -> None:
        spread = self._covariance[:2, :2] + np.eye(2) * self._sigma2(fix)
        gain = np.linalg.solve(spread, self._covariance[:2]).T
        self._state = self._state + gain @ (self._measured(fix) - self._state[:2])
        self._covariance = self._covariance - gain @ self._covariance[:2]

    def _is_restart(self, fix: Fix) -> bool:
        """Whether this fix is one of enough in a row that agree with each other and not with the track."""
        here = _Rejected(self._measured(fix), self._sigma2(fix), self._clock_s)
        if self._rejected:
            last = self._rejected[-1]
            reach = self.motion.speed_m_s * (here.clock_s - last.clock_s) + 4 * math.sqrt(here.sigma2 + last.sigma2)
            if np.linalg.norm(here.place - last.place) > reach:
                self._rejected.clear()
        self._rejected.append(here)
        return len(self._rejected) >= self.motion.restart

    def _coasted(self, fix: Fix) -> Fix:
        """A fix's place replaced by the expected one."""
        sigma_m = _sigma_m(self._covariance)
        nothing = Fix(
            fix.query, "no_fix", fix.reasons, matches=fix.matches, inliers=fix.inliers, enhanced=fix.enhanced,
            definition=fix.definition, milliseconds=fix.milliseconds, time=fix.time, flight=fix.flight,
        )  # fmt: skip
        if sigma_m > self.motion.coast_m:
            return nothing
        latitude, longitude = self._place(self._state)
        return replace(nothing, status="coasted", latitude=latitude, longitude=longitude, sigma_m=sigma_m)

    def _measured(self, fix: Fix) -> np.ndarray:
        assert self._origin is not None
        return offset_m(self._origin, np.array(fix.place))

    def _place(self, state: np.ndarray) -> tuple[float, float]:
        assert self._origin is not None
        latitude, longitude = moved(self._origin, state[:2])
        return float(latitude), float(longitude)

    def _sigma2(self, fix: Fix) -> float:
        return (fix.sigma_m or 0.0) ** 2 + self.motion.floor_m**2

    def _pass(self, time: datetime | None) -> float:
        """The seconds since the last picture, after which the clock stands at this one."""
        seconds = self._seconds_until(time)
        self._clock_s += seconds
        self._time = time or (self._time and self._time + timedelta(seconds=seconds))
        return seconds

    def _seconds_until(self, time: datetime | None) -> float:
        """Seconds from the last picture to a time; the usual interval where the clock does not tell.

        Clocks are set back, and some cameras record a zone with only a part of their pictures.
        """
        if time is None or self._time is None or (time.utcoffset() is None) != (self._time.utcoffset() is None):
            return self.motion.interval_s
        seconds = (time - self._time).total_seconds()
        return seconds if seconds >= 0 else self.motion.interval_s


def _sigma_m(covariance: np.ndarray) -> float:
    """Standard deviation per axis of the place in a state's covariance."""
    return float(np.sqrt(np.trace(covariance[:2, :2]) / 2))
