"""The room shaders/: every shape, light, lobe and sampler against a float64 answer. `probes` expose the functions."""
