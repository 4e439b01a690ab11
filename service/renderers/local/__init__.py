"""One renderer's process, kept alive: what was sent to it can be sent again to a new one.

supervisor  one renderer, as whoever has work for it sees it
tasks       its tasks: their messages go to listeners, and a new process gets them when one is lost
keeper      keeps one process alive: starts, watches and replaces it
restarts    when a lost process is started again
process     one process: how it is started, watched and ended
"""
