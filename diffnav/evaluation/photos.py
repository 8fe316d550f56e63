"""A folder of dark photographs, enhanced into another folder."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import nn
from tqdm import tqdm

from diffnav.errors import UserError
from diffnav.images import IMAGE_SUFFIXES, ImageError, find_images, read_exif, read_image, write_image
from diffnav.retinex.enhancer import SMALLEST_PX


@dataclass(frozen=True)
class Job:
    """One photograph: the file to read and the file to write."""

    source: Path
    target: Path


@dataclass(frozen=True)
class Outcome:
    """What became of the jobs. written: the new files. skipped: one sentence for each photograph left out."""

    written: list[Path]
    skipped: list[str]


def plan_photos(images: str | Path, out: str | Path, overwrite: bool = False) -> list[Job]:
    """A job for every image below the folder `images`, or for that one file: the same relative name below `out`.

    `out` may lie inside `images`: what is in it is no photograph to enhance.

    Raises:
        UserError: there is no image, `out` is a file, a result would replace an original, or results exist already and
            `overwrite` is not set; nothing has been written then.
    """
    images, out = Path(images).expanduser(), Path(out).expanduser()
    if out.exists() and not out.is_dir():
        raise UserError(f"out={out} is a file: give a folder, in which each photograph keeps its name")
    root, sources = (images.parent, [images]) if images.is_file() else (images, find_images(images))
    if images.is_file() and images.suffix.lower() not in IMAGE_SUFFIXES:
        raise UserError(f"images={images} is no image: its ending should be one of {' '.join(sorted(IMAGE_SUFFIXES))}")
    if root.resolve() in out.resolve().parents:
        sources = [path for path in sources if out.resolve() not in path.resolve().parents]
    if not sources:
        raise UserError(f"all images in {images} lie in out={out}: give the folder of the dark photographs")
    jobs = [Job(source, out / source.relative_to(root)) for source in sources]
    _refuse_to_replace(jobs, overwrite)
    return jobs


def _refuse_to_replace(jobs: Sequence[Job], overwrite: bool) -> None:
    """Raise UserError where a target is one of the sources, or exists and must not be overwritten."""
    # Identities, not names: a folder can be reached through links, or under another case.
    originals = {_identity(job.source) for job in jobs if job.source.exists()}
    existing = [job.target for job in jobs if job.target.exists()]
    for target in existing:
        if _identity(target) in originals:
            raise UserError(f"{target} is one of the originals, which would be lost: give another folder as out=")
    if existing and not overwrite:
        raise UserError(
            f"{len(existing)} of {len(jobs)} results exist already, the first is {existing[0]}: "
            "add overwrite=true or give another folder as out="
        )


def _identity(path: Path) -> tuple[int, int]:
    status = os.stat(path)
    return status.st_dev, status.st_ino


@torch.no_grad()
def enhance_photos(
    jobs: Sequence[Job], enhancer: nn.Module, device: torch.device, bf16: bool = False, quality: int = 95
) -> Outcome:
    """Enhance photograph after photograph, with a progress bar; each file appears whole or not at all.

    What cannot be read, or is smaller than 16 x 16, is skipped. Results have the size and the kind of file of their
    originals, upright, with their EXIF tags, as 8-bit RGB; alpha and colour profiles are lost.

    Args:
        enhancer: (1, 3, H, W) in [0, 1] -> the same, on `device`. bf16: whether networks run in bf16.
        quality: of JPEG and WebP, 1 to 100.
    Raises: UserError if the enhancer cannot work on photographs alone, or a file cannot be written.
    """
    outcome = Outcome([], [])
    for job in tqdm(jobs, desc="enhancing", unit="photo"):
        try:
            low = read_image(job.source)
            if min(low.shape[1:]) < SMALLEST_PX:
                size = f"{low.shape[2]} x {low.shape[1]} pixels"
                raise ImageError(f"{job.source}: {size}, less than {SMALLEST_PX} x {SMALLEST_PX}; enlarge it first")
        except ImageError as error:
            outcome.skipped.append(str(error))
            continue
        with torch.autocast(device.type, dtype=torch.bfloat16, enabled=bf16):
            enhanced = enhancer(low[None].to(device))[0]
        write_image(job.target, enhanced, quality, read_exif(job.source))
        outcome.written.append(job.target)
    return outcome
