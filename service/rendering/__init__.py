"""What is wanted of the renderer, how far it is, and the process that owns the GPU."""
