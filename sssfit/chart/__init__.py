"""Draws records as figures, one file per figure; results are computed elsewhere.

`page` has their common parts and writes them: the same figure gives the same bytes. Only this room
imports matplotlib, and never its pyplot, which takes 0.8 s to import and keeps global state.
`files` and `data` do not import it, because they are needed before a figure is drawn.
"""
