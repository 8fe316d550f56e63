"""Which spatial frequencies of the daylight picture an enhanced picture still holds: coherence and gain per octave."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import torch
from kornia.color import rgb_to_grayscale
from torch import Tensor
from tqdm import tqdm

from diffnav.data.pair_source import PairSource
from diffnav.data.pairs import WholePair
from diffnav.evaluation.aggregate import Row, mean_with_interval
from diffnav.evaluation.predictions import pair_digest
from diffnav.evaluation.runner import MethodError, Runner
from diffnav.evaluation.usable import refuse_none, usable_pairs
from diffnav.retinex.enhancer import RetinexEnhancer
from diffnav.retinex.tiles import apply_tiled

# (low, high], cycles per pixel: the octaves from the finest detail that every direction can hold to 128 px a cycle.
BANDS = [(2.0 ** -(octave + 1), 2.0**-octave) for octave in range(1, 7)]
# What a Retinex enhancer multiplies, each measured beside the product.
PARTS = ("R", "Ih")
# Mean square on [0, 1], of a millionth of an 8-bit level: what is less is rounding, not a picture.
_SMALLEST_POWER = 1e-18


class BandFigures(NamedTuple):
    """One band of a picture E against daylight N: sum E conj(N) / sqrt(sum |E|^2 sum |N|^2) and the rms ratio E : N.

    coherence in [-1, 1], negative where the band is inverted; gain >= 0; both None where the daylight picture holds
    nothing in the band.
    """

    coherence: float | None
    gain: float | None


@dataclass(frozen=True)
class SpectrumRecord:
    """What one method, or a `part` (R or Ih) of it, holds of one photo. bands: in the order of BANDS.

    failure: why the method failed; the figures are then those of the dark input.
    """

    method: str
    part: str
    name: str
    site: str
    bands: Sequence[BandFigures]
    failure: str | None = None

    @property
    def label(self) -> str:
        return f"{self.method}: {self.part}" if self.part else self.method

    def flat(self) -> list[Row]:
        """One row per band, low and high being its limits in cycles per pixel."""
        row = {"method": self.label, "name": self.name, "site": self.site, "failure": self.failure}
        return [
            {**row, "low": low, "high": high, **figures._asdict()}
            for (low, high), figures in zip(BANDS, self.bands, strict=True)
        ]


@dataclass
class SpectrumMeasurement:
    """Every record, photo by photo and method by method, and one sentence per photo that could not be used."""

    records: list[SpectrumRecord] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)


def windowed_spectrum(grey: Tensor) -> Tensor:
    """Fourier coefficients (H, W), complex128, of a picture (H, W) less its mean, under a Hann window, over H W.

    The window keeps the jump between opposite borders from filling all frequencies.
    """
    grey = grey.double()
    rows, columns = (torch.hann_window(side, dtype=grey.dtype, device=grey.device) for side in grey.shape)
    return torch.fft.fft2((grey - grey.mean()) * rows[:, None] * columns, norm="forward")


def band_figures(image: Tensor, normal: Tensor) -> list[BandFigures]:
    """Coherence and gain of a luminance against that of the daylight picture, both (H, W), in each of BANDS.

    The whole plane is summed, both signs of a frequency, so the sum of E conj(N) is real. Diagonal frequencies above
    half a cycle per pixel belong to no band.
    """
    E, N = windowed_spectrum(image), windowed_spectrum(normal)
    y, x = (torch.fft.fftfreq(side, dtype=torch.float64, device=E.device) for side in E.shape)
    frequency = torch.hypot(y[:, None], x)
    figures = []
    for low, high in BANDS:
        inside = (frequency > low) & (frequency <= high)
        e, n = E[inside], N[inside]
        common, power, power_normal = ((a * b.conj()).sum().real.item() for a, b in ((e, n), (e, e), (n, n)))
        if power_normal < _SMALLEST_POWER:
            figures.append(BandFigures(None, None))
        elif power < _SMALLEST_POWER:
            figures.append(BandFigures(0.0, 0.0))
        else:
            figures.append(BandFigures(common / (power * power_normal) ** 0.5, (power / power_normal) ** 0.5))
    return figures


@torch.no_grad()
def part_luminances(enhancer: RetinexEnhancer, low: Tensor) -> dict[str, Tensor]:
    """Luminance of R, and Ih, of a dark picture (3, H, W): each (H, W), not rounded to 8 bit."""

    def network(image: Tensor) -> Tensor:
        parts = enhancer.components(image)
        # Tiles have three channels.
        return torch.cat([rgb_to_grayscale(parts.R), parts.Ih, parts.Ih], 1)

    R, Ih, _ = apply_tiled(network, low[None], enhancer.tile_pixels, enhancer.halo)[0]
    return {"R": R, "Ih": Ih}


def measure_spectra(source: PairSource, runners: Sequence[Runner], progress: bool = False) -> SpectrumMeasurement:
    """What every method, and R and Ih of every Retinex network, holds of every photo.

    Raises: UserError if no photo can be used.
    """
    result = SpectrumMeasurement()
    with tqdm(total=len(source.photos) * len(runners), desc="spectra", unit="image", disable=not progress) as bar:
        for _, pair in usable_pairs(source, result.problems, bar, len(runners)):
            digest = pair_digest(pair)
            for runner in runners:
                result.records += _records_of(runner, pair, digest)
                bar.update()
    if not result.records:
        refuse_none(len(source.photos), result.problems)
    return result


def _records_of(runner: Runner, pair: WholePair, digest: str) -> list[SpectrumRecord]:
    method, failure = runner.method, None
    retinex = method.enhancer if isinstance(method.enhancer, RetinexEnhancer) else None
    normal, dark = (rgb_to_grayscale(pair[side])[0] for side in ("normal", "low"))
    pictures = {"": dark} | (dict.fromkeys(PARTS, dark) if retinex else {})
    try:
        pictures[""] = rgb_to_grayscale(runner.predict(pair, runner.key(digest)).image)[0]
        if retinex:
            pictures |= part_luminances(retinex, pair["low"].to(method.device))
    except MethodError as error:
        failure = str(error)
    return [
        SpectrumRecord(method.name, part, pair["name"], pair["site"], band_figures(picture.cpu(), normal), failure)
        for part, picture in pictures.items()
    ]


def spectrum_rows(records: Sequence[SpectrumRecord], seed: int = 0) -> list[Row]:
    """One plain row per method and part, ready for JSON.

    bands: of each its limits low and high (cycles per pixel), n photos that hold something in it, the means of
    coherence and gain over them with 95 % bootstrap intervals. n photos, failures among them; none of a method that
    failed on all.
    """
    groups: dict[str, list[SpectrumRecord]] = {}
    for record in records:
        groups.setdefault(record.label, []).append(record)
    return [_row(label, own, seed) for label, own in groups.items()]


def _row(label: str, records: Sequence[SpectrumRecord], seed: int) -> Row:
    failures = [{"name": r.name, "why": r.failure} for r in records if r.failure]
    scored = records if len(failures) < len(records) else []
    bands: list[Row] = []
    for index, (low, high) in enumerate(BANDS):
        own = [r.bands[index] for r in scored]
        coherences = [figures.coherence for figures in own if figures.coherence is not None]
        gains = [figures.gain for figures in own if figures.gain is not None]
        means = mean_with_interval("coherence", coherences, seed) | mean_with_interval("gain", gains, seed)
        bands.append({"low": low, "high": high, "n": len(gains), **means})
    return {
        "method": label,
        "enhancer": records[0].method,
        "part": records[0].part,
        "n": len(scored),
        "failures": failures,
        "bands": bands,
    }
