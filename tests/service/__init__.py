"""The room service/: what a scene means, over HTTP, the stream and the command line."""
