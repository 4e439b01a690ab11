"""The frames and images that a client gets.

frames            frames and images of a task's picture, on demand
first_look        small pictures of a scene whose own kernel is being compiled
fallback_preview  first looks by the superset kernel of the scene that was edited
first_look_main   that process: `python -m service.worker.view.first_look_main`
unoptimised_look  first looks by a small kernel without optimisation, in a process beside the renderer
under_hand        a guess at the picture after an edit, until it has samples of its own
view_tables       tables of the views that tone maps name, baked when they are first asked for
denoise_policy    when a picture is denoised, and what of it is shown meanwhile
"""
