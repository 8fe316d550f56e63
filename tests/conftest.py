"""Property tests draw the same examples at each run, so that a green suite stays green; `make test-all` draws more."""

from hypothesis import settings

settings.register_profile("repeatable", derandomize=True)
settings.load_profile("repeatable")
