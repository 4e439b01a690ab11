"""The server's process: what a request means, from the network to the disk.

app         what is served: the routes and the editor's files
launch      how a server starts, and the socket that it listens on
state       what the routes share
routes      the endpoints
http        between the network and the routes
requests    from what a caller wrote to what the renderer takes
renders     renders asked for over REST
batches     renders of one scene that differ along axes
callbacks   URLs that are told of the ends of renders and batches
verdict     whether two pictures differ beyond noise
streams     scenes that are edited while they are watched
assets      uploaded assets, and files beside a scene
storage     the data folder
readiness   what is loaded at the start, and whether a picture can be rendered now: the first frame of a scene
"""
