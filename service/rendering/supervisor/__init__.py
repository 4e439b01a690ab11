"""The renderers' processes, kept alive: what was sent to one can be sent again to a new one, or to another.

devices     which renderers the configuration asks for, and what each gets of the machine
pool        several renderers behind one door: which of them gets a task, and who goes on with a lost one's
division    which renderers assist which tasks; leases and results are handed on between them
supervisor  one renderer: routes its messages to listeners, and replays the tasks when it is lost
task        one task as the server has it
replay_log  the messages of one task, so that another renderer can go on with it
keeper      keeps one process alive: starts, watches and replaces it
restarts    when a lost process is started again
process     one process: how it is started, watched and ended
"""
