"""Renderers on the hosts of a Ray cluster (SUNBOX_RAY), behind the same supervisor as those of this machine.

Server - Unix sockets - gateway - Ray - actor - Unix socket - the ordinary renderer's process. The gateway is a
process of this machine and Ray's driver: Ray may block, write to stderr, or abort its process when the cluster is
gone, and the server must not be harmed by that. Where an actor runs, when it is restarted, and how bytes travel
between hosts is up to Ray.

cluster     the server's side: joins a cluster through the gateway, and starts renderers there
pool        a pool of renderers that are all actors of one cluster
control     what the server and the gateway say to each other beside the renderers' own messages
gateway     the process that speaks to Ray
joining     how the gateway joins a cluster, or says why it can't
renderers   how many renderers a cluster is asked for, and what is declared to Ray for each
lane        one renderer in the gateway: carries messages between its supervisor's socket and its actor
carriage    how one message travels through Ray: small ones together, large ones by the object store
actor       the actor, which runs the renderer's process on its node
"""
