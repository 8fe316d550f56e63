"""Zero-DCE with its authors' weights."""

from diffnav.enhancers.zero_dce import ZeroDce
from diffnav.pretrained import file_sha256, filling_from, load_weights, pretrained_path


class PublishedZeroDce(ZeroDce):
    """Our Zero-DCE, published weights: (B, 3, H, W) in [0, 1] -> the same.

    folder: of published weights, None for the usual one (`pretrained_path`). Raises: UserError if it does not fit.
    """

    def __init__(self, folder: str | None = None) -> None:
        super().__init__()
        source = "github.com/Li-Chongyi/Zero-DCE, Zero-DCE_code/snapshots/Epoch99.pth"
        path = pretrained_path("zero-dce/Epoch99.pth", source, folder)
        self.sha256 = file_sha256(path)
        published = load_weights(path)
        # e_conv1 .. e_conv7 are our layers 0 .. 6.
        with filling_from(path):
            layers = {f"{int(name[6]) - 1}{name[7:]}": tensor for name, tensor in published.items()}
            self.layers.load_state_dict(layers)
        self.requires_grad_(False).eval()
