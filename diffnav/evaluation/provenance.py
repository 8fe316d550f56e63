"""What a result was made with: versions, device, commit."""

import platform
import subprocess
from importlib import metadata
from pathlib import Path

import torch

from diffnav import __version__

_PACKAGES = ("torch", "kornia", "opencv-contrib-python-headless", "numpy", "pillow")


def versions() -> dict[str, str]:
    """Name -> version of Python, of diffnav and of the packages that decide numbers."""
    found = {"python": platform.python_version(), "diffnav": __version__}
    for name in _PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "unknown"
    return found


def device_name(device: torch.device) -> str:
    """The processor's or the GPU's name; a CPU with the number of threads torch uses."""
    name = processor_name(device)
    return name if device.type == "cuda" else f"{name}, {torch.get_num_threads()} thread(s)"


def processor_name(device: torch.device) -> str:
    """The processor's or the GPU's name."""
    return torch.cuda.get_device_name(device) if device.type == "cuda" else _cpu_model()


def _cpu_model() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return models[0] if models else platform.processor() or platform.machine()


def git_commit() -> str | None:
    """The commit of the clone that this package lies in, with "+changes" where its files differ; None elsewhere."""
    folder = Path(__file__).parents[1]

    def git(*arguments: str) -> str:
        return subprocess.run(
            ["git", "-C", str(folder), *arguments], capture_output=True, text=True, check=True, timeout=10
        ).stdout.strip()

    try:
        # A package installed inside some other repository is not of that repository's commit.
        git("ls-files", "--error-unmatch", "__init__.py")
        return git("rev-parse", "HEAD") + ("+changes" if git("status", "--porcelain", "--", ".") else "")
    except (OSError, subprocess.SubprocessError):
        return None
