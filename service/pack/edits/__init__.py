"""Reuse of a packed scene's parts after an edit.

cache         geometries and environments of earlier versions, within a budget
scene_delta   which arrays of two versions differ
moved_meshes  which meshes an editor has moved
"""
