"""The renderer's process, kept alive: what was sent to it can be sent again to a new one.

supervisor  starts the process, routes its messages to listeners, and replaces it when it is lost
process     one process: how it is started, watched and ended
replay_log  the messages of one task, so that another renderer can go on with it
"""
