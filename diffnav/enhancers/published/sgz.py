"""SGZ with its authors' weights: Zero-DCE++'s network, trained with a semantic loss besides."""

from diffnav.enhancers.published.zero_dce_pp import ReusedCurve


class PublishedSgz(ReusedCurve):
    """SGZ: (B, 3, H, W) in [0, 1] -> the same. folder: of published weights, None for the usual one.

    Raises: UserError if it does not fit. Source: Zheng & Gupta, Semantic-Guided Zero-Shot Learning, WACVW 2022.
    """

    def __init__(self, folder: str | None = None) -> None:
        source = "github.com/ShenZheng2000/Semantic-Guided-Low-Light-Image-Enhancement, weight/Epoch99.pth"
        super().__init__("sgz/Epoch99.pth", source, folder)
