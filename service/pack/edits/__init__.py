"""Reuse of a packed scene's parts after an edit.

cache         geometries and environments of earlier versions, within a budget
scene_edit    the edit that leads from one version's arrays to another's
moved_meshes  which meshes an editor has moved
"""
