"""The enhancement experiment (Table 1): every method on every pair, one record each."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from tqdm import tqdm

from diffnav.data.pair_source import PairSource
from diffnav.data.pairs import WholePair
from diffnav.evaluation.predictions import pair_digest
from diffnav.evaluation.records import ImageRecord, RecordLog
from diffnav.evaluation.runner import MethodError, Runner
from diffnav.evaluation.usable import refuse_none, usable_pairs
from diffnav.scores import psnr, ssim


@dataclass
class Measurement:
    """Every record, photo by photo and method by method, and one sentence per photo that could not be used."""

    records: list[ImageRecord] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)


def measure(
    source: PairSource, runners: Sequence[Runner], log: RecordLog[ImageRecord], progress: bool = False
) -> Measurement:
    """What every method makes of every pair; what `log` already holds is not computed again.

    Raises: UserError if no photo can be used.
    """
    result = Measurement()
    with tqdm(total=len(source.photos) * len(runners), desc="enhancing", unit="image", disable=not progress) as bar:
        for photo, pair in usable_pairs(source, result.problems, bar, len(runners)):
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
        refuse_none(len(source.photos), result.problems)
    return result


def record_of(runner: Runner, pair: WholePair, key: str) -> ImageRecord:
    """The record of one method on one pair.

    Where the method fails, it has the scores of the dark input, which is what would go on, and says why.
    """
    image, failure = pair["low"], None
    figures: dict[str, Any] = {"seconds": None}
    try:
        prediction = runner.predict(pair, key)
        image, figures = prediction.image, prediction.figures()
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
        failure=failure,
        **figures,
    )
