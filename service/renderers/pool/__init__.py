"""Several renderers behind one door.

devices   which renderers the configuration asks for, and what each gets of the machine
pool      which of them gets a task, and which goes on with a lost one's
division  which renderers assist which tasks; leases and results are handed on between them
"""
