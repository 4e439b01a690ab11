"""The frames and images that a client gets.

frames            frames and images of a task's picture, on demand
fallback_preview  first frames by a kernel for many scenes, until a scene's own is compiled
under_hand        a guess at the picture after an edit, until it has samples of its own
view_tables       tables of the views that tone maps name, baked when they are first asked for
denoise_policy    when a picture is denoised, and what of it is shown meanwhile
"""
