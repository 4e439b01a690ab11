"""The renderers as the server sees them: processes of this machine, or of a cluster, behind one protocol.

protocol        what the server asks of its renderers
local           one process: started, watched, replaced, and its tasks replayed when it is lost
pool            several renderers behind one door; a picture divided among them
ray             renderers on the hosts of a Ray cluster, behind the same supervisor
replay_log      one task and its messages, so that another renderer can go on with it; states to which it may go back
statistics      counters and distributions, for /metrics
ask             one question to them and its one answer; those about BSDFs
"""
