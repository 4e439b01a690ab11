"""Measurements of a scene at hand. Public.

kernel_cost      what a scene's own kernel saves beside the one with every feature on
path_truncation  the light that ends with the bounces
metering         pictures without the noise meter, to measure what it costs
"""
