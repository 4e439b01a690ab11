"""One renderer's process, kept alive: what was sent to it can be sent again to a new one.

supervisor  one renderer, as the server sees it, and its tasks
keeper      keeps one process alive: starts, watches and replaces it, after a pause where it dies again and again
process     one process: how it is started, watched and ended
"""
