"""How well pictures are located: queries asked of localizers, and what their answers are worth."""
