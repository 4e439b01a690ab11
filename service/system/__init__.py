"""Linux, below everything: processes, memory, time, threads, files.

child_processes  children that parse strangers' files, as the service starts and ends them; what children inherit
confined         what such a child gives up before it reads anything
lifeline         a process ends when another one does
cpu              how long a process was able to run; niceness of threads and processes
shared_memory    arrays that another process may map
memory           one budget of memory for all work
shares           what each caller has of something that all share
turns            whose turn it is: one order of callers for queues, threads and rooms
garbage          the garbage collector, out of the way of large imports
disk_usage       what files take on a disk: blocks and inodes
background       tasks that nobody awaits, none of which dies unseen; waits for an event, for a time
executors        the threads of the server's slow work
logs             how and where log records are written: a line or a JSON object for each
"""
