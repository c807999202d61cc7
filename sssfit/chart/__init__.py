"""Records to figures, one file a figure; nothing is computed here beyond what drawing takes.

`page` has what they share and writes them: the same figure gives the same bytes. Matplotlib is
imported in this room only, and never its pyplot, which takes 0.8 s to import and keeps global
state; `files` and `data` do without it, for what is asked before there is anything to draw.
"""
