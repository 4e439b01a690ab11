"""Lights, and how often each of them is picked.

lights            shapes that shine and lights of the document -> records with their probabilities
light_kinds       a row for each kind of light: its record, area and bounds
light_bounds      where lights are and where they shine, for the tree by which one of many is picked
environment       an environment -> texels and the tables that directions are drawn from
environment_blur  its texels, blurred
"""
