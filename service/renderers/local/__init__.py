"""One renderer's process, kept alive: what was sent to it can be sent again to a new one.

supervisor  one renderer, as the server sees it, and its tasks
events      what the owner of several renderers learns of each of them
keeper      keeps one process alive: starts, watches and replaces it
restarts    when a lost process is started again
process     one process: how it is started, watched and ended
"""
