"""Readers of measured reflection: files of how much light a real surface sends from anywhere to anywhere.

merl         the files of the MERL database: a table over half and difference angles
tensor_file  the container of the RGL database: named arrays
adaptive     what its files say: a table over the numbers that drew directions, by the surface's own facets
warp         densities over the unit square, and the maps that draw from them
directions   angles and directions about the half vector
transfer     what the reading process sends of it
energy       how much of the light a table sends back, and what takes it down to all of it
"""
