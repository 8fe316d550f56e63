"""What eval.driving makes of its configuration: the drive, the test, its shard, the facts behind a result."""

import os
from pathlib import Path
from typing import Any

import torch
from hydra.utils import instantiate
from omegaconf import DictConfig

from conf.command import plain, whole_number
from diffnav.data.driving.driving_set import DrivingSet
from diffnav.data.pair_source import PairSource
from diffnav.errors import UserError
from diffnav.evaluation.driving.drive_test import DriveTest
from diffnav.evaluation.driving.measure import Shard
from diffnav.evaluation.driving.records import DrivingRecord
from diffnav.evaluation.driving.references import Reference, ReferenceReader, read_references
from diffnav.evaluation.match_records import Verify
from diffnav.evaluation.methods import Method
from diffnav.evaluation.predictions import PredictionCache
from diffnav.evaluation.provenance import device_name, git_commit, versions
from diffnav.evaluation.records import RecordLog
from diffnav.matching.matches import Matches
from eval.contest_session import make_matchers
from eval.session import below_shared, data_choice, plain_list


def make_drive(cfg: DictConfig) -> DrivingSet:
    """The driving set of `data`, every `step`-th moment of it."""
    if "_target_" not in cfg.data:
        raise UserError(
            f"data={data_choice()} is no driving set; choose e.g. zpark, kitti_odometry, paired or scenes_drive"
        )
    drive: DrivingSet = instantiate(cfg.data)
    return drive.every(whole_number("step", cfg.step, 1))


def make_test(cfg: DictConfig, drive: DrivingSet, methods: list[Method], workers: int) -> DriveTest:
    """The task that asks the queries; reads all references."""
    cache = Path(str(cfg.cache)).expanduser() if cfg.cache else None
    side = None if cfg.longest_side is None else whole_number("longest_side", cfg.longest_side, 64)
    matchers, settings = make_matchers(cfg.matchers), plain(cfg)
    shortlist = None if cfg.shortlist is None else whole_number("shortlist", cfg.shortlist, 1)
    verified, verify, darkness = whole_number("verified", cfg.verified, 0), make_verify(cfg), instantiate(cfg.darkness)
    reader = ReferenceReader(matchers, side, cache / "references" if cache else None)
    drive, references = read_references(drive, reader, workers, progress=True)
    return DriveTest(
        drive=drive,
        references=references,
        pairs=PairSource([], darkness, cfg.seed),
        darkness=settings["darkness"],
        methods=methods,
        matchers=matchers,
        cache=PredictionCache(cache),
        verify=verify,
        verification=settings["verification"],
        verified=verified,
        shortlist=shortlist,
        longest_side=side,
    )


def make_verify(cfg: DictConfig) -> Verify:
    """The verification, tried on nothing, so that a setting out of range is told before anything is read."""
    if cfg.verification.get("model") != "fundamental":
        raise UserError("verification.model must be fundamental here: a street is no plane")
    verify: Verify = instantiate(cfg.verification)
    nothing = torch.zeros(0, 2)
    verify(Matches(nothing, nothing, torch.zeros(0), "", {}))
    return verify


def make_shard(cfg: DictConfig) -> Shard:
    """`shard`, or what torchrun says of this process."""
    if cfg.shard is not None:
        parts = plain_list(cfg.shard)
        if len(parts) != 2 or any(type(part) is not int for part in parts):
            raise UserError(f"shard must be [index, count], e.g. [0,4], got {parts}")
        return Shard(*parts)
    return Shard(int(os.environ.get("RANK", 0)), int(os.environ.get("WORLD_SIZE", 1)))


def open_log(out: Path, shard: Shard) -> RecordLog[DrivingRecord]:
    """The records of this shard, and those that the others have written so far."""
    own = "records.jsonl" if shard.count == 1 else f"records-{shard.index}-of-{shard.count}.jsonl"
    beside = [path for path in sorted(out.glob("records*.jsonl")) if path.name != own]
    return RecordLog(out / own, DrivingRecord, beside)


def remarks(drive: DrivingSet, references: list[Reference]) -> list[str]:
    """What a user should know about the pictures, one sentence each."""
    found = list(drive.notes)
    sizes = sorted({reference.size for reference in references})
    if len(sizes) > 1:
        named = ", ".join(f"{width} x {height}" for height, width in sizes[:4])
        found.append(
            f"references have {len(sizes)} sizes ({named}{', ...' if len(sizes) > 4 else ''}), matched as they are"
        )
    grey = sum(reference.grey for reference in references)
    if 0 < grey < len(references):
        found.append(f"{grey} of {len(references)} references are grey, the others in colour")
    return found


def driving_protocol(cfg: DictConfig, device: torch.device, test: DriveTest, workers: int) -> dict[str, Any]:
    """What decides the numbers of a result, as plain values; paths below the shared data folder are cut to it."""
    settings = below_shared(plain(cfg), cfg)
    return {
        "data": {"kind": data_choice(), **settings["data"]},
        "pairs_by_record": test.drive.counts,
        "remarks": remarks(test.drive, list(test.references)),
        **{
            key: settings[key]
            for key in ("darkness", "verified", "verification", "shortlist", "longest_side", "step", "seed")
        },
        "matchers": {named.name: dict(named.matcher.settings) for named in test.matchers},
        "workers": workers,
        "device": device_name(device),
        "versions": versions(),
        "commit": git_commit(),
        "weights_sha256": {method.name: method.sha256 for method in test.methods if method.sha256},
    }
