"""The renderers as the server sees them: processes of this machine, or of a cluster, behind one protocol.

protocol        what the server asks of its renderers
local           one process: started, watched, replaced, and its tasks replayed when it is lost
pool            several renderers behind one door; a picture divided among them
ray             renderers on the hosts of a Ray cluster, behind the same supervisor
task            one task as the server has it
replay_log      the messages of one task, so that another renderer can go on with it
working_states  which states of a task a renderer may go back to
statistics      counters and distributions, for /metrics
ask             one question to them and its one answer
bsdf_questions  questions about the BSDF of one material
"""
