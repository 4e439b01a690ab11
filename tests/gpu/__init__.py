"""The room gpu/: arrays to images, without a server."""
