"""Darkened views through random homographies against the daylight picture that they show."""

from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar

from diffnav.data.match_pairs.match_pair import MatchPair, size_of
from diffnav.data.match_pairs.random_views import RandomViewPairs
from diffnav.data.photos import Photo
from diffnav.data.store import PhotoStore
from diffnav.geometry.views import draw_view, shows_image
from diffnav.images import from_uint8, quantise
from diffnav.retinex.enhancer import SMALLEST_PX


class HomographyPairs(RandomViewPairs):
    """Each photo in daylight is the reference; a view of it, of the same size, is darkened by Eq. 9 and enhanced.

    Where the view reaches beyond the picture it holds its mirror image, so that no black edge becomes a feature, and
    counts for nothing. Arguments: those of `RandomViews`.
    """

    kind: ClassVar[str] = "homography"

    @property
    def photos(self) -> Sequence[Photo]:
        """Daylight alone: a stored dark picture is no view."""
        return [replace(photo, low=None, record=None) for photo in self.source.photos]

    def read(self, photo: Photo) -> MatchPair:
        """The query and reference of one photo. Raises: UserError if it cannot be used."""
        photo = replace(photo, low=None, record=None)
        store = PhotoStore([photo], self.source.size, SMALLEST_PX)
        reference = from_uint8(store.normal[0])
        size = size_of(reference)
        H_view_reference = self.views.draw(size, self.source.seed, photo.name)
        view = quantise(draw_view(reference, H_view_reference, size))
        seen = replace(photo, normal=lambda: view)
        pair = replace(self.source, size=None).read(seen)
        visible = shows_image(H_view_reference, size, size)
        return MatchPair(pair, reference, H_view_reference, visible=visible)
