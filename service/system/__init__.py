"""Linux, below everything: processes, memory, time, threads, files.

child_processes  children that parse strangers' files, as the service starts and ends them; what children inherit
confined         what such a child gives up before it reads anything
lifeline         a process ends when another one does
cpu_time         how long a process was able to run
shared_memory    arrays that another process may map
memory           one budget of memory for all work
shares           what each caller has of something that all of them share
turns            whom the work at hand is for, and turns that go round these callers
garbage          the garbage collector, out of the way of large imports
disk_usage       what files take on a disk: blocks and inodes
background       tasks that nobody awaits, none of which dies unseen
waiting          waits for an event, for a time
power            whether there is power to spare for work that nobody asked for
executors        the threads of the server's slow work
logs             a line or a JSON object for each event
priority         niceness of threads and processes
"""
