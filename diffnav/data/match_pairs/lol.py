"""Real dark pictures, enhanced and then seen through random homographies, against their bright counterparts."""

from functools import partial
from typing import ClassVar

from diffnav.data.match_pairs.match_pair import MatchPair, size_of
from diffnav.data.match_pairs.random_views import RandomViewPairs
from diffnav.data.photos import Photo
from diffnav.errors import UserError
from diffnav.geometry.views import draw_view, shows_image


class LolPairs(RandomViewPairs):
    """Each real dark picture is enhanced as it was taken; then a view of the result is drawn, which is the query.

    Drawn before, its interpolation would smooth the very noise that makes real darkness hard. Beyond the picture's
    edges the view holds its mirror image, which counts for nothing. Arguments: those of `RandomViews`.
    """

    kind: ClassVar[str] = "lol"

    def read(self, photo: Photo) -> MatchPair:
        """The query and reference of one photo. Raises: UserError if it cannot be used."""
        if photo.low is None:
            raise UserError(f"{photo.name}: has no real dark picture; pairs=lol needs data of low/ with high/")
        pair = self.source.read(photo)
        size = size_of(pair["normal"])
        H_view_picture = self.views.draw(size, self.source.seed, photo.name)
        view = partial(draw_view, H_view_image=H_view_picture, size=size)
        return MatchPair(pair, pair["normal"], H_view_picture, view, shows_image(H_view_picture, size, size))
