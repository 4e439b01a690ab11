"""What is wanted of the renderer, how far it is, and the process that owns the GPU.

requests     from what a caller wrote to what the renderer takes
jobs         renders asked for over REST
streams      scenes that are edited while they are watched
bsdf         questions about the BSDF of one material
renderers    what the server asks of its renderers, as a protocol
supervisor   the renderer's process, kept alive
cluster      renderers on the hosts of a Ray cluster, behind the same supervisor
statistics   counters and distributions, for /metrics
ipc          what both processes say to each other
worker       the renderer's process itself: the only room here that imports `gpu`
executors    the threads of the server's slow work
first_frame  the first frame of a scene that no client asked for: for readiness, and to warm up
priority     niceness of threads and processes
"""
