"""diffnav: makes dark aerial and street pictures matchable.

enhancer = diffnav.load_enhancer("compact_joint")   # a torch.nn.Module
bright = enhancer(dark)                             # (B, 3, H, W) RGB in [0, 1] -> the same
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from diffnav.checkpoints import load_enhancer

__version__ = "0.1.0"
__all__ = ["__version__", "load_enhancer"]


def __getattr__(name: str) -> Any:
    # Looked up when it is used: `import diffnav` alone does not load torch.
    if name == "load_enhancer":
        from diffnav.checkpoints import load_enhancer

        return load_enhancer
    raise AttributeError(f"module 'diffnav' has no attribute {name!r}")
