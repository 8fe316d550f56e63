"""The enhancement experiment (Table 1): every method on every pair, one record each."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from tqdm import tqdm

from diffnav.darkness import DarknessModel
from diffnav.data.pairs import WholePair, WholePairs
from diffnav.data.photos import Photo
from diffnav.data.store import PhotoStore
from diffnav.errors import UserError
from diffnav.evaluation.predictions import pair_digest
from diffnav.evaluation.records import ImageRecord, RecordLog
from diffnav.evaluation.runner import MethodError, Runner
from diffnav.retinex.enhancer import SMALLEST_PX
from diffnav.scores import psnr, ssim


@dataclass(frozen=True)
class PairSource:
    """Which pairs are measured: photos, how they are darkened, and the size (h, w) they are resized to, if any."""

    photos: Sequence[Photo]
    darkness: DarknessModel
    seed: int = 0
    size: tuple[int, int] | None = None

    def read(self, photo: Photo) -> WholePair:
        """The pair of one photo. Raises: UserError if it cannot be read or has no daylight picture."""
        if photo.normal is None:
            raise UserError(f"{photo.low}: has no daylight picture to compare with")
        # One photo at a time: a test set may be larger than the memory.
        return WholePairs(PhotoStore([photo], self.size, SMALLEST_PX), self.darkness, self.seed)[0]


@dataclass
class Measurement:
    """Every record, photo by photo and method by method, and one sentence per photo that could not be used."""

    records: list[ImageRecord] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)


def measure(source: PairSource, runners: Sequence[Runner], log: RecordLog, progress: bool = False) -> Measurement:
    """What every method makes of every pair; what `log` already holds is not computed again.

    Raises: UserError if no photo can be used.
    """
    result = Measurement()
    with tqdm(total=len(source.photos) * len(runners), desc="enhancing", unit="image", disable=not progress) as bar:
        for photo in source.photos:
            try:
                pair = source.read(photo)
            except UserError as error:
                result.problems.append(str(error))
                bar.update(len(runners))
                continue
            digest = pair_digest(pair)
            for runner in runners:
                key = runner.key(digest)
                record = log.find(key)
                if record is None:
                    record = record_of(runner, pair, key)
                    log.add(record)
                # The same pixels and weights may go by another name today.
                result.records.append(replace(record, method=runner.method.name, name=photo.name, site=photo.site))
                bar.update()
    if not result.records:
        first = f": {result.problems[0]}" if result.problems else ""
        raise UserError(f"none of {len(source.photos)} photos can be used{first}")
    return result


def record_of(runner: Runner, pair: WholePair, key: str) -> ImageRecord:
    """The record of one method on one pair.

    Where the method fails, it has the scores of the dark input, which is what would go on, and says why.
    """
    image, seconds, state, failure = pair["low"], None, {}, None
    try:
        prediction = runner.predict(pair, key)
        image, seconds, state = prediction.image, prediction.seconds, prediction.state
    except MethodError as error:
        failure = str(error)
    normal, record = pair["normal"], pair["record"]
    return ImageRecord(
        key=key,
        method=runner.method.name,
        name=pair["name"],
        site=pair["site"],
        gamma=record.gamma if record else None,
        height=normal.shape[1],
        width=normal.shape[2],
        psnr=psnr(image[None], normal[None]).item(),
        ssim=ssim(image[None], normal[None]).item(),
        seconds=seconds,
        failure=failure,
        state=state,
    )
