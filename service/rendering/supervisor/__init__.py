"""The renderer's process, kept alive: what it is told, and what it takes to tell a new one all of it again.

supervisor  starts the process, routes its messages to listeners, and replaces it when it is lost
process     one process: how it is started, watched and ended
replay_log  what one task was told, so that another renderer can go on with it
"""
